// SPDX-License-Identifier: GPL-3.0-or-later
// Takes rights from a process that reads untrusted files: a fault in a library then cannot do more
// than give wrong voxels. Linux only; where the kernel lacks a part, that part is left out.
#pragma once

#include <filesystem>
#include <span>

namespace semblance::problems {

// The parts that this kernel offers to an ordinary process.
struct Confinement {
  bool files = false;  // Landlock: only the given files, and the system's libraries, can be opened
  bool calls = false;  // seccomp: only the system calls that reading needs
};
Confinement FindConfinement();

// From here on this process, which must have a single thread, can open nothing but `readable` and
// the system's libraries (/usr, /lib), and these for reading only. It can write to the descriptors
// that are open, use memory, and start threads. It cannot create, change or remove a file, open a
// socket, start a process or another program, signal another process, or get these rights back.
// readable: files, or folders with all that is in them; links are followed now.
void Confine(std::span<const std::filesystem::path> readable);

}  // namespace semblance::problems
