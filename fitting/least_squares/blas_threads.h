// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace semblance {

// OpenBLAS, where the sparse Cholesky uses it, sums in an order that depends on its number of
// threads, and so on the machine. One thread gives the same bytes everywhere (and small blocks gain
// nothing from more); looked up at run time, for other BLAS libraries have no such function.
void UseOneBlasThread();

}  // namespace semblance
