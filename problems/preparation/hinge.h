// SPDX-License-Identifier: GPL-3.0-or-later
// A mandible as a mesh of its own, which turns about its condyles.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/subject/landmarks.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct MandibleOptions {
  std::filesystem::path mesh;         // empty: none
  std::optional<double> opening_deg;  // above 0 opens the mouth further
  std::optional<double> bite_mm;      // instead: so far are pr and id apart
  // Middles of the condyles, LPS, mm; both, or none: as the average skull has them.
  std::optional<std::array<double, 3>> condyle_left, condyle_right;
};

template <class Visitor>
void Fields(Visitor& visit, MandibleOptions& o) {
  visit(
      FieldInfo{.name = "mesh",
                .doc = "the mandible alone, in the skull's frame, axes and units; empty where the "
                       "skull has it"},
      o.mesh);
  visit(FieldInfo{.name = "opening_deg",
                  .unit = "deg",
                  .min = -60,
                  .max = 60,
                  .doc = "turns the mandible, and the landmarks on it, about the condyles; above 0 "
                         "opens the mouth further than scanned, below 0 closes it"},
        o.opening_deg);
  visit(FieldInfo{.name = "bite_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 100,
                  .doc = "instead of an angle: turned so far that pr and id are this far apart"},
        o.bite_mm);
  visit(FieldInfo{.name = "condyle_left",
                  .unit = "mm",
                  .doc = "middle of the left condyle, LPS (+x is the subject's left); else "
                         "predicted from the landmarks"},
        o.condyle_left);
  visit(FieldInfo{.name = "condyle_right", .unit = "mm", .doc = "of the right one; both or none"},
        o.condyle_right);
}

// What is wrong with two condyles, in words; empty where they can be an axis. Exchanged ones would
// open a mouth that is to close, and points that are all but one have no direction.
std::string CondyleFault(const std::array<double, 3>& left, const std::array<double, 3>& right);

template <class Report>
void CheckValue(Report& report, const MandibleOptions& o) {
  if (o.opening_deg && o.bite_mm) {
    report("bite_mm", "the mouth is opened twice, by an angle and a distance; give one of them");
  }
  if (o.condyle_left.has_value() != o.condyle_right.has_value()) {
    report(o.condyle_left ? "condyle_left" : "condyle_right",
           "an axis needs both condyles; give the other one too, or none");
  }
  if (o.condyle_left && o.condyle_right) {
    if (const std::string fault = CondyleFault(*o.condyle_left, *o.condyle_right); !fault.empty()) {
      report("condyle_left", fault);
    }
  }
  if (o.mesh.empty() && (o.opening_deg || o.bite_mm || o.condyle_left)) {
    report("mesh", "there is no mesh to turn; name that of the mandible");
  }
}

struct Hinge {
  Vec3 left = Vec3::Constant(kNaN), right = Vec3::Constant(kNaN);  // middles of the condyles

  // The point after the mouth has opened so far, about the line from right to left. The same bits
  // for 0.
  Vec3 Opened(const Vec3& p, double opening_deg) const;
};

// The condyles of the options, else where the average skull has them (jaw_pose.h), laid onto the
// cranium's sites. Throws InputError if those are fewer than three, or on a line, and for condyles
// with a CondyleFault.
Hinge HingeOf(const MandibleOptions& options, const LandmarkFile& landmarks);

// The opening nearest to 0 that brings `lower`, which turns, to bite_mm from `upper`. Throws
// InputError if none does, saying which distances there are.
double OpeningForBite_deg(const Hinge& hinge, const Vec3& upper, const Vec3& lower, double bite_mm);

// Adds the mandible to the skull, turned as the options say, and turns the landmarks on it. Returns
// what was done, a line each. Throws InputError as above, and for a bite without landmarks pr, id.
std::vector<std::string> AddMandible(const MandibleOptions& options, TriMesh mandible,
                                     TriMesh& skull, LandmarkFile& landmarks);

}  // namespace semblance
