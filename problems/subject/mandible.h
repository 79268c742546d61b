// SPDX-License-Identifier: GPL-3.0-or-later
// The lower jaw: its sites, its pose against the cranium as the landmarks show it, and a separate
// mesh of it that turns about the condyles.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "problems/subject/average_skull.h"
#include "problems/subject/landmarks.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// True if the site lies on the mandible.
bool IsOfMandible(std::string_view site);

// The middles of the left and the right condyle in the average skull's frame: 11 mm below and 5 mm
// in front of supraglenoid, 10 mm towards the middle.
std::array<Vec3, 2> AverageCondyles();

struct JawPose {
  double opening_deg =
      kNaN;              // relative to the average skull's closed jaw; negative: closed further
  double off_mm = kNaN;  // median distance of the mandible's sites from the cranium's prediction
};

// Fits the average skull (FitAverageSkull) twice, to the sites of the cranium and to those of the
// mandible. The opening is the rotation between the two fits about the condyles' axis. It is within
// some degrees of 0 for heads that bite. `sites` must be standard. Returns nothing if the cranium
// or the mandible has fewer than four sites, or if they do not span a triangle.
std::optional<JawPose> FindJawPose(std::span<const SitePoint> sites);

struct MandibleOptions {
  std::filesystem::path mesh;
  std::optional<double> opening_deg;
  std::optional<double> bite_mm;
  std::optional<std::array<double, 3>> condyle_left, condyle_right;
};

template <class Visitor>
void Fields(Visitor& visit, MandibleOptions& o) {
  visit(FieldInfo{.name = "mesh",
                  .doc = "mesh of the mandible alone, in the skull's frame, axes and units; empty "
                         "if the skull's mesh includes it"},
        o.mesh);
  visit(FieldInfo{.name = "opening_deg",
                  .unit = "deg",
                  .min = -60,
                  .max = 60,
                  .doc = "turns the mandible and the landmarks on it about the condyles; above 0 "
                         "opens the mouth further than scanned, below 0 closes it"},
        o.opening_deg);
  visit(FieldInfo{.name = "bite_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 100,
                  .doc =
                      "instead of an angle: turns the mandible until pr and id are this far apart"},
        o.bite_mm);
  visit(FieldInfo{.name = "condyle_left",
                  .unit = "mm",
                  .doc = "middle of the left condyle, LPS (+x is the subject's left); without it "
                         "the landmarks predict both condyles"},
        o.condyle_left);
  visit(FieldInfo{.name = "condyle_right",
                  .unit = "mm",
                  .doc = "middle of the right condyle; give both or none"},
        o.condyle_right);
}

// The fault of two condyles; empty if they can be an axis. Exchanged condyles would open a mouth
// that should close, and two points that nearly coincide define no direction.
std::string CondyleFault(const std::array<double, 3>& left, const std::array<double, 3>& right);

template <class Report>
void CheckValue(Report& report, const MandibleOptions& o) {
  if (o.opening_deg && o.bite_mm) {
    report("bite_mm",
           "the opening is given twice, as an angle and as a distance; give one of them");
  }
  if (o.condyle_left.has_value() != o.condyle_right.has_value()) {
    report(o.condyle_left ? "condyle_left" : "condyle_right",
           "an axis needs both condyles; give the other one too, or neither");
  }
  if (o.condyle_left && o.condyle_right) {
    if (const std::string fault = CondyleFault(*o.condyle_left, *o.condyle_right); !fault.empty()) {
      report("condyle_left", fault);
    }
  }
  if (o.mesh.empty() && (o.opening_deg || o.bite_mm || o.condyle_left)) {
    report("mesh", "there is no mesh to turn; name the mesh of the mandible");
  }
}

struct Hinge {
  Vec3 left = Vec3::Constant(kNaN), right = Vec3::Constant(kNaN);  // middles of the condyles

  // The point after the mouth has opened by the angle about the line from the right to the left
  // condyle. An angle of 0 returns the exact bits.
  Vec3 Opened(const Vec3& p, double opening_deg) const;
};

// The axis through the condyles of the options. Without them the average skull's condyles are used,
// laid onto the cranium's landmarks. Throws InputError if those landmarks are fewer than three or
// lie on a line, and for condyles with a CondyleFault.
Hinge FindHinge(const MandibleOptions& options, const LandmarkFile& landmarks);

// The opening nearest to 0 that brings `lower`, which turns, to the distance bite_mm from `upper`.
// Throws InputError, with the possible distances, if no opening does.
double OpeningForBite_deg(const Hinge& hinge, const Vec3& upper, const Vec3& lower, double bite_mm);

// Turns the mandible and the landmarks on it as the options state, and adds it to the skull.
// Returns notes on what was done. Throws InputError as FindHinge and OpeningForBite_deg, and for a
// bite without the landmarks pr and id.
std::vector<std::string> AddMandible(const MandibleOptions& options, TriMesh mandible,
                                     TriMesh& skull, LandmarkFile& landmarks);

}  // namespace semblance::problems
