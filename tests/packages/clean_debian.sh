#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Tests the packages in a bare Debian 12: apt installs them; the demo gives the figures of docs/experiments/figures.md; Python imports the
# module; manual page and completions exist; programs that use the libraries are built and linked. Needs root. debootstrap makes ROOT if it does not exist.
#
# usage: clean_debian.sh PACKAGES ROOT
set -euo pipefail
packages=$(realpath "$1")
root=$(realpath -m "$2")
source=$(realpath "$(dirname "$0")/../..")

[ -d "$root/usr" ] || debootstrap --variant=minbase bookworm "$root" "${MIRROR:-http://deb.debian.org/debian}"
mkdir -p "$root/proc" "$root/packages"
mountpoint -q "$root/proc" || mount -t proc proc "$root/proc"
trap 'umount "$root/proc"' EXIT
cp "$packages"/*.deb "$root/packages/"

inside() {
  chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive sh -euc "cd /root; $1"
}

inside 'apt-get update -qq'
# The demo's head comes with what semblance recommends.
inside 'cd /packages && apt-get install -y -qq --reinstall ./semblance_*.deb ./python3-semblance_*.deb ./libsemblance-dev_*.deb'

inside 'rm -rf demo && semblance run /usr/share/semblance/configs/demo.yaml --out demo --quiet'
row=$(grep -F 'semblance run configs/demo.yaml' "$source/docs/experiments/figures.md" | grep -F '%')
inside "python3 - '$row'" <<'END'
import json, re, sys
face = json.load(open("demo/result.json"))["face"]
ours = ", ".join("%.2f" % face[name] for name in ("mean_abs_mm", "rms_mm", "median_mm", "p95_mm")) + " mm, %.1f %%" % (100 * face["within_2_5mm"])
lengths, share = re.findall(r"\| ([\d., ]+ mm) \| ([\d.]+ %)", sys.argv[1])[0]
print("here:  ", ours)
print("stated:", lengths + ", " + share)
sys.exit(ours != lengths + ", " + share)
END

inside 'python3 -c "import semblance; print(semblance.__doc__.splitlines()[0])"'
inside 'cd /usr/share && test -s man/man1/semblance.1* && test -s bash-completion/completions/semblance && test -s zsh/vendor-completions/_semblance &&
  test -s fish/vendor_completions.d/semblance.fish'
# A program of somebody else, with the dependencies of libsemblance-dev and a compiler alone: of one layer, and of all.
inside 'apt-get install -y -qq --no-install-recommends cmake make g++'
rm -rf "$root/root/consumer" && cp -r "$source/tests/consumer" "$root/root/consumer"
inside 'cmake -S consumer -B consumer/fitting > /dev/null && make -s -C consumer/fitting && printf "0 0 0\n1 0 0\n0 1 0\n1 1 0\n" > plane.txt &&
  sed -i "s/COMPONENTS fitting/COMPONENTS problems/; s/semblance::fitting/semblance::problems/" consumer/CMakeLists.txt &&
  printf "#include <semblance/problems/run.h>\nint main() { return semblance::problems::Run({}, {}).Faults().empty(); }\n" > consumer/main.cc &&
  cmake -S consumer -B consumer/problems > /dev/null && make -s -C consumer/problems'
echo "the packages install in a bare Debian 12, and the demo gives the stated figures"
