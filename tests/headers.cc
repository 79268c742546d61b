// SPDX-License-Identifier: GPL-3.0-or-later
// Nothing of its own: the target of this file holds the headers that the tests share, compiled
// once.
