# SPDX-License-Identifier: GPL-3.0-or-later
# The entry point: installs packages, builds, runs. Everything it needs to know is in .ci/packages.txt, CMakePresets.json and configs/.
PACKAGES      = $(shell grep -v '# profile' .ci/packages.txt | sed 's/#.*//')
RUN_PACKAGES  = $(shell grep -Ev '# (tests|profile)' .ci/packages.txt | sed 's/#.*//')
SUDO         := $(if $(filter 0,$(shell id -u)),,sudo)
PRESET       ?= release
BUILD        := $(if $(filter sanitize debug quick threads coverage,$(PRESET)),build-$(PRESET),build)
PROGRAM      := $(BUILD)/problems/semblance
DEMO_OUT     ?= out/demo
BASE         ?= HEAD~1

.PHONY: all setup configure build demo demo-phantom deb site thesis heads test test-all harness bench profile same-bytes clang-numbers sanitize races coverage \
  format check headers tidy configs clean

all: build

setup:
	@command -v apt-get > /dev/null || { echo "make installs packages with apt-get, which this system lacks. Install the counterparts of these" \
	  "Debian packages by hand and call cmake --preset release, or use the Containerfile:"; echo $(PACKAGES); exit 1; }
	@missing=""; for p in $(PACKAGES); do \
	  dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || missing="$$missing $$p"; done; \
	if [ -n "$$missing" ]; then echo "installing:$$missing"; \
	  $(SUDO) apt-get update -qq && \
	  $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $$missing; fi

configure: setup
	@cmake --preset $(PRESET) > configure.log 2>&1 || { cat configure.log; exit 1; }; rm -f configure.log

build: configure
	@cmake --build --preset $(PRESET)

# The targets demo, demo-phantom and deb build without the tests, many sources per compilation: the fastest way from nothing.
demo demo-phantom deb: PACKAGES = $(RUN_PACKAGES)
demo demo-phantom deb: PRESET = quick

# A face from a real head CT.
demo: configure
	@cmake --build --preset quick --target semblance
	@build-quick/problems/semblance run configs/demo.yaml --out $(DEMO_OUT) --force
	@echo "this head in the browser:  build-quick/problems/semblance workbench configs/demo.yaml --out out/workbench"
	@echo "your own CT or skull:      build-quick/problems/semblance workbench YOUR_CT_OR_SKULL --out out/mine"

# Every step on a made-up person who lacks a cheek bone: the CT as DICOM, skull and skin, proposed landmarks and their errors, the mirrored cheek,
# face and head, the score.
demo-phantom: PHANTOM = out/demo-phantom
demo-phantom: configure
	@cmake --build --preset quick --target semblance
	@build-quick/problems/semblance phantom --out $(PHANTOM)/head --lost zy_r --force
	@build-quick/problems/semblance import-ct $(PHANTOM)/head/ct --out $(PHANTOM)/import --force
	@build-quick/problems/semblance landmarks propose $(PHANTOM)/import/skull.ply --out $(PHANTOM)/proposed.yaml \
	  --compare $(PHANTOM)/head/landmarks.yaml --force
	@build-quick/problems/semblance run configs/demo_phantom/head.yaml --out $(PHANTOM)/run --force

# Debian packages of program, libraries and Python module, in build-quick/packages.
deb: PACKAGES = $(RUN_PACKAGES) dpkg-dev pybind11-dev python3-dev python3-numpy
deb: configure
	@cmake --build --preset quick
	@cd build-quick && cpack > packages.log || { cat packages.log; exit 1; }
	@ls build-quick/packages/*.deb

# The documents as static pages, in out/site.
site: PACKAGES = $(shell grep -E '^python3(-markdown-it)? ' .ci/packages.txt | sed 's/#.*//')
site: setup
	@/usr/bin/python3 docs/site.py out/site

# Every figure and table of docs/thesis.md on one page, out/thesis/index.html; about ten minutes on two cores. ONLY makes some:
# ONLY="3.4 A.1".
thesis: PACKAGES = $(RUN_PACKAGES) python3 python3-numpy python3-markdown-it
thesis: PRESET = quick
thesis: configure
	@cmake --build --preset quick --target semblance
	@/usr/bin/python3 -B docs/thesis/make.py build-quick/problems/semblance out/thesis $(addprefix --only ,$(ONLY))

# Every head of the folder HEADS that has a true skin, recovered with measured depths and with those of tables: one table, pictures, and the
# table of docs/experiments/heads.md. ONLY="54 people.*" makes some.
HEADS        ?= ../shared/data
heads: PACKAGES = $(RUN_PACKAGES) python3
heads: PRESET = quick
heads: configure
	@cmake --build --preset quick --target semblance
	@/usr/bin/python3 -B docs/heads.py build-quick/problems/semblance $(HEADS) out/heads $(if $(ONLY),--only "$(ONLY)",--page docs/experiments/heads.md)

# The everyday tests: all but those with the labels documents (commands and figures of the documents), packaging, and thorough (pages in a
# browser, a cluster, whole heads and studies). CI runs all.
test: build
	@ctest --preset $(PRESET) -j "$$(nproc)"

test-all: build
	@ctest --preset all -j "$$(nproc)"

# Hostile calls, injected faults, pairs of options, fuzzing. ONLY selects some of: attack faults pairwise fuzz (docs/explanation/reliability.md).
# SEED, LAWS, COUNT, PAIRS, SHARE and MINUTES set how much of each.
export SEED LAWS COUNT PAIRS SHARE MINUTES JOBS
harness: build
	@tests/harness/harness.sh $(PROGRAM) configs $(ONLY)

# Our program against peers, measured in one run; build/bench.json holds the entries and the machine. POINTS: a folder of sets of points with
# the heights that were kept back (fit_bench files).
bench: build
	@cmake --build build --target bench
	@for program in build/tests/bench/*_bench; do echo "$$program" >&2; $$program; done | tee build/bench.lines >&2
	@if [ -n "$(POINTS)" ]; then build/tests/bench/fit_bench files "$(POINTS)" | tee -a build/bench.lines >&2; fi
	@{ echo '{"machine": "'"$$(grep -m1 'model name' /proc/cpuinfo | cut -d: -f2 | sed 's/^ //'), $$(nproc) cores"'",'; \
	  echo '"entries": ['; grep '^{' build/bench.lines | sed '$$!s/$$/,/'; echo ']}'; } > build/bench.json; rm build/bench.lines
	@echo build/bench.json

# The cost of each step of a run, and its ten hottest functions. ONLY selects some of: demo vhm cthead trial.
profile: PACKAGES = $(RUN_PACKAGES) $(shell grep -E '^python3 |# profile' .ci/packages.txt | sed 's/#.*//')
profile: PRESET = quick
profile: configure
	@cmake --build --preset quick --target semblance
	@/usr/bin/python3 -B tests/bench/profile.py build-quick/problems/semblance . $(ONLY)

# A run, a depth and a fit in many environments, and by programs for older processors, give the same bytes.
same-bytes: build
	@for bits in 256 128; do \
	  cmake --preset $(PRESET) -B build-$$bits -DSEMBLANCE_WIDEST_BITS=$$bits -DBUILD_TESTING=OFF > /dev/null && \
	  cmake --build build-$$bits --target semblance || exit 1; done
	@python3 -B tests/harness/same_bytes.py $(PROGRAM) configs --program "no AVX-512"=build-256/problems/semblance \
	  --program "no AVX"=build-128/problems/semblance

# A program compiled by clang gives the same numbers within 1e-9.
clang-numbers: build
	@CXX=clang++ cmake --preset quick -B build-clang -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG" -DSEMBLANCE_WITH_CAD=OFF -DSEMBLANCE_WITH_ITK=OFF > /dev/null
	@cmake --build build-clang --target semblance
	@python3 -B tests/harness/same_bytes.py $(PROGRAM) configs --compiler clang=build-clang/problems/semblance --compilers-only

# The tests with AddressSanitizer and UndefinedBehaviorSanitizer.
sanitize:
	@$(MAKE) --no-print-directory test PRESET=sanitize

# The tests that start threads, with ThreadSanitizer: a filter over their names.
RACES        ?= *Parallel*:*Polygonize*:*ImplicitFace*:*DepthDirection*:*CrossValidation*:*InterpolateDepth*:*FaceMetrics*:*Render*:Run.*:*DiskCache*:*ImportCt*:*Recentre*:*Relaxation*:*ShapeModel*:*SpaceSolve*:*Bench*:*HttpServer*:*NestedSolve*:*Study*
races: setup
	@cmake --preset threads > /dev/null
	@cmake --build --preset threads
	@GTEST_FILTER="$(RACES)" ctest --preset threads -R "^(surfaces|interp|fitting|problems)_"

# Lines and branches that the tests execute, in the sources that read files (READERS); READERS=. for all sources. Needs gcovr. Not on a full
# disk: the counts could not be written.
READERS      ?= surfaces/mesh_files/|surfaces/base/(csv|json_text|npy)|surfaces/hspline_files/(hspline_json|json_parts)|problems/config/|problems/io/volumes/|problems/subject/landmark_files/|problems/points/point_(files|table)|problems/subject/(network_file|tissue_table)|problems/face/(edit_script|template_io)|problems/study/trial_folder
coverage: setup
	@cmake --preset coverage "-DSEMBLANCE_COVERAGE=$(READERS)" > /dev/null
	@cmake --build --preset coverage
	@GTEST_FILTER=-*AFullDisk* ctest --preset coverage -j "$$(nproc)" --quiet; \
	gcovr -r . build-coverage -j "$$(nproc)" --exclude-throw-branches --exclude-unreachable-branches -e tests/ --json build-coverage/coverage.json
	@python3 tests/coverage.py build-coverage/coverage.json "$(READERS)"

format: setup
	@git ls-files '*.h' '*.cc' | xargs clang-format -i

# Everything that CI checks beside the tests.
check: build headers tidy configs
	@git ls-files '*.h' '*.cc' | xargs clang-format --dry-run -Werror

# Each header compiles alone; in a build without precompiled headers its own source proves that for most.
headers: build
	@cmake --build --preset $(PRESET) --target semblance_headers

# clang-tidy on the sources changed since BASE, a commit. clang cannot read g++'s precompiled headers and rejects its memory options.
tidy: setup
	@cmake --preset $(PRESET) -B build-tidy -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DSEMBLANCE_AMPLE_MEMORY=OFF > /dev/null
	@git diff --name-only --diff-filter=d $(BASE) -- 'surfaces/*.cc' 'interp/*.cc' 'fitting/*.cc' 'problems/*.cc' | \
	  xargs -r -n 1 -P $$(nproc) clang-tidy -p build-tidy --quiet --extra-arg=-Wno-unknown-warning-option

# The program accepts every configuration and study, with all files that they name. The real heads and the results of the demos are not part
# of the project, and published.yaml names no subject: their inputs are not opened.
configs: PARTS = configs/published.yaml
configs: build
	@$(PROGRAM) check $(filter-out $(PARTS),$(wildcard configs/*.yaml)) configs/fit/*.yaml configs/studies/*.yaml docs/thesis/*.yaml
	@$(PROGRAM) check --without-inputs $(PARTS) configs/heads/*.yaml configs/demo_phantom/*.yaml configs/population/*.yaml

clean:
	@rm -rf build build-*
