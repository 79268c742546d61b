# SPDX-License-Identifier: GPL-3.0-or-later
"""A depth scheme and a metric of one's own in a study, beside built-in ones, in the same ranking.

    PYTHONPATH=build/python python3 docs/examples/own_scheme.py
"""
import pathlib

import numpy as np
import semblance
from semblance.testing import check_scheme

CONFIGS = pathlib.Path(__file__).resolve().parents[2] / "configs"


@semblance.scheme("shepard", power=4.0)
def shepard(given, power):
    """Means of the markers' depths with weights distance^-power (Shepard 1968)."""
    distance_mm = np.linalg.norm(given.vertices[:, None] - given.bases, axis=2)
    weights = np.maximum(distance_mm, 1e-9) ** -power
    return weights @ given.depths_mm / weights.sum(axis=1)


@semblance.metric("chin_mm")
def chin_mm(result):
    """Distance of the chin's true skin from the nearest vertex of the recovered face, on average."""
    vertices, _ = result.truth
    chin = vertices[result.region & (result.parts == semblance.FACE_PARTS.index("chin"))]
    face, _ = result.face
    return np.mean([np.linalg.norm(face - point, axis=1).min() for point in chin])


if __name__ == "__main__":
    check_scheme(shepard, linear=True)  # the laws that built-in schemes obey too

    pathlib.Path("own.yaml").write_text(f"""
base: {CONFIGS}/phantom.yaml
set: {{subject.rings: 24, implicit.resolution: 60, seeds.level: 0, template.max_level: 1, first_fit: [],
      fit.plan.schedule: [{{level: 0, fraction: 1}}]}}
subjects: [{{name: a, set: {{subject.random_seed: 1}}}}, {{name: b, set: {{subject.random_seed: 2}}}}]
grid: {{interp: [mean, {{type: inverse_distance, power: 4, max_angle_deg: 180}}, shepard, {{type: shepard, power: 2}}]}}
metric: chin_mm
""")
    table = semblance.study("own.yaml", out="own", jobs=2, schemes=[shepard], metrics=[chin_mm], wide=True)
    errors_mm = {}
    for row in table if isinstance(table, list) else table.to_dict("records"):
        errors_mm.setdefault(row["interp"], []).append(row["chin_mm"])
    for scheme, values in sorted(errors_mm.items(), key=lambda item: np.mean(item[1])):
        print(f"{scheme:50s} chin {np.mean(values):.2f} mm")
    # The built-in scheme of the same formula gives the same faces.
    np.testing.assert_allclose(errors_mm["shepard"], errors_mm["inverse_distance power=4 max_angle_deg=180"], rtol=1e-6)
