// SPDX-License-Identifier: GPL-3.0-or-later
// Each layer of the project is a namespace. A layer sees the names of the layers below it without
// qualification; a name of its own hides the same name of a lower layer. interp and fitting do not
// see each other.
#pragma once

namespace semblance::surfaces {}  // namespace semblance::surfaces

namespace semblance::interp {  // from a few depths to a depth field
using namespace surfaces;
}

namespace semblance::fitting {  // from points to a surface
using namespace surfaces;
}

namespace semblance::problems {  // from a configuration to a report
using namespace surfaces;
using namespace interp;
using namespace fitting;
}  // namespace semblance::problems
