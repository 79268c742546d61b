# SPDX-License-Identifier: GPL-3.0-or-later
# The front door: sets up, builds, runs. All that it knows stands in .ci/packages.txt, CMakePresets.json and configs/.
PACKAGES      = $(shell sed 's/#.*//' .ci/packages.txt)
RUN_PACKAGES  = $(shell grep -v '# tests' .ci/packages.txt | sed 's/#.*//')
SUDO         := $(if $(filter 0,$(shell id -u)),,sudo)
PRESET       ?= release
BUILD        := $(if $(filter sanitize debug quick threads coverage,$(PRESET)),build-$(PRESET),build)
DEMO_OUT     ?= out/demo
BASE         ?= HEAD~1

.PHONY: all setup configure build deb demo demo-phantom test bench faults attack same-bytes clang-numbers pairwise pairwise-share fuzz sanitize races coverage format check headers tidy configs clean site

all: build

setup:
	@missing=""; for p in $(PACKAGES); do \
	  dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || missing="$$missing $$p"; done; \
	if [ -n "$$missing" ]; then echo "installing:$$missing"; \
	  $(SUDO) apt-get update -qq && \
	  $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $$missing; fi

configure: setup
	@cmake --preset $(PRESET) > configure.log 2>&1 || { cat configure.log; exit 1; }; rm -f configure.log

build: configure
	@cmake --build --preset $(PRESET)

# Debian packages of the program and of the libraries, in build/packages.
deb: build
	@cd $(BUILD) && cpack > packages.log || { cat packages.log; exit 1; }
	@ls $(BUILD)/packages/*.deb

# The documents as static pages, in out/site.
site: PACKAGES = $(shell grep -E '^python3(-markdown-it)? ' .ci/packages.txt | sed 's/#.*//')
site: setup
	@/usr/bin/python3 docs/site.py out/site

# The program alone, in the way that builds fastest from nothing: the tests would double the time.
demo: PACKAGES = $(RUN_PACKAGES)
demo: PRESET = quick
demo: configure
	@cmake --build --preset quick --target semblance
	@build-quick/problems/semblance run configs/demo.yaml --out $(DEMO_OUT) --force

# A whole head that is made up and lacks a cheek bone: its CT as DICOM, skull and skin of it, landmarks proposed (and how far off), the cheek
# mirrored, its face and head, the score. The folder is that of the configuration.
demo-phantom: PACKAGES = $(RUN_PACKAGES)
demo-phantom: PRESET = quick
demo-phantom: PHANTOM = out/demo-phantom
demo-phantom: configure
	@cmake --build --preset quick --target semblance
	@build-quick/problems/semblance phantom --out $(PHANTOM)/head --lost zy_r --force
	@build-quick/problems/semblance import-ct $(PHANTOM)/head/ct --out $(PHANTOM)/import --force
	@build-quick/problems/semblance landmarks propose $(PHANTOM)/import/skull.ply --out $(PHANTOM)/proposed.yaml \
	  --compare $(PHANTOM)/head/landmarks.yaml --force
	@build-quick/problems/semblance run configs/demo_phantom/head.yaml --out $(PHANTOM)/run --force

test: build
	@ctest --preset $(PRESET) -j "$$(nproc)"

# Measures against peers in one run; build/bench.json holds the lines and the machine.
bench: build
	@cmake --build build --target bench
	@for program in build/tests/bench/*_bench; do echo "$$program" >&2; $$program; done | tee build/bench.lines >&2
	@{ echo '{"machine": "'"$$(grep -m1 'model name' /proc/cpuinfo | cut -d: -f2 | sed 's/^ //'), $$(nproc) cores"'",'; \
	  echo '"entries": ['; grep '^{' build/bench.lines | sed '$$!s/$$/,/'; echo ']}'; } > build/bench.json; rm build/bench.lines
	@echo build/bench.json

# Kills, full disks, little memory, damaged files: a table of how many fell short (docs/reliability.md).
COUNT        ?= 100
faults: build
	@tests/faults/faults.sh $(BUILD)/problems/semblance configs $(COUNT)

# Over 2,000 hostile calls of every command; SEED draws others (docs/reliability.md).
SEED         ?= 1
attack: build
	@python3 -B tests/attack/attack.py $(BUILD)/problems/semblance configs --seed $(SEED) --jobs "$$(nproc)"

# A run, a depth and a fit in many surroundings, and by programs for older processors: the same bytes (docs/reliability.md).
same-bytes: build
	@for bits in 256 128; do \
	  cmake --preset $(PRESET) -B build-$$bits -DSEMBLANCE_WIDEST_BITS=$$bits -DBUILD_TESTING=OFF > /dev/null && \
	  cmake --build build-$$bits --target semblance || exit 1; done
	@python3 -B tests/faults/same_bytes.py $(BUILD)/problems/semblance configs --program "no AVX-512"=build-256/problems/semblance \
	  --program "no AVX"=build-128/problems/semblance

# The same by a program of clang's: numbers within 1e-9. It is built in the way that is fastest from nothing.
clang-numbers: build
	@CXX=clang++ cmake --preset quick -B build-clang -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG" -DSEMBLANCE_WITH_CAD=OFF -DSEMBLANCE_WITH_ITK=OFF > /dev/null
	@cmake --build build-clang --target semblance
	@python3 -B tests/faults/same_bytes.py $(BUILD)/problems/semblance configs --compiler clang=build-clang/problems/semblance --compilers-only

# All pairs of options, each run on the smallest phantom or a few points, or refused at once (docs/reliability.md).
PAIRS        ?= 1000000
pairwise: build
	@python3 -B tests/pairwise/pairwise.py $(BUILD)/problems/semblance configs --kind fit --cases $(PAIRS)
	@python3 -B tests/pairwise/pairwise.py $(BUILD)/problems/semblance configs --kind experiment --cases $(PAIRS)

# Of these what 50 seconds of processor are enough for, others every day.
pairwise-share: build
	@python3 -B tests/pairwise/pairwise.py $(BUILD)/problems/semblance configs --kind fit --share 20 --seed day
	@python3 -B tests/pairwise/pairwise.py $(BUILD)/problems/semblance configs --kind experiment --share 30 --seed day

# Each reader under libFuzzer with ASan and UBSan for so many minutes, JOBS at a time; needs clang and its runtime (docs/reliability.md).
MINUTES      ?= 10
JOBS         ?= $(shell nproc)
FUZZERS       = mesh_reader_fuzz config_fuzz text_reader_fuzz invesalius_fuzz volume_fuzz
fuzz:
	@CXX=clang++ cmake -G Ninja -B build-fuzz -DSEMBLANCE_FUZZ=ON -DBUILD_TESTING=ON > /dev/null
	@cmake --build build-fuzz --target $(FUZZERS)
	@JOBS=$(JOBS) tests/fuzz/fuzz.sh build-fuzz/tests/fuzz $(MINUTES) $(FUZZERS)

# The tests once more, with AddressSanitizer and UndefinedBehaviorSanitizer.
sanitize:
	@$(MAKE) --no-print-directory test PRESET=sanitize

# Those that start threads, with ThreadSanitizer.
RACES         = parallel_test polygonize_test implicit_face_test depth_direction_test cross_validation_test interpolate_depth_test \
  face_metrics_test render_test run_test disk_cache_test import_ct_test recentre_test relaxation_test shape_model_test space_solve_test bench_test \
  http_server_test nested_solve_test study_test
races: setup
	@cmake --preset threads > /dev/null
	@cmake --build --preset threads --target $(RACES)
	@ctest --preset threads -R "^($$(echo $(RACES) | tr ' ' '|'))\."

# Lines and branches of what reads files (READERS) that these tests pass; COVERED=. READERS=. for all of both. Needs gcovr.
# Not on a full disk: there the counts cannot be written either.
COVERED      ?= mesh_io_test|mesh_readers_test|vtk_xml_test|glb_test|npy_test|csv_test|json_text_test|hspline_json_test|feature_test|config_edit_test|config_test|value_filter_test|terminal_text_test|command_line_test|input_check_test|read_landmarks_test|landmark_commands_test|point_files_test|point_table_test|fit_command_test|point_fit_test|apart_test|invesalius_test|ct_volume_test|read_volume_test|read_dicom_test|read_nifti_test|read_nrrd_test|slice_stack_test|import_ct_test|import_commands_test|network_file_test|tissue_table_test|template_io_test|edit_script_test|condition_depths_test|depth_spread_test|population_run_test|trust_test|trial_folder_test
READERS      ?= surfaces/mesh_files/|surfaces/base/(csv|json_text|npy)|surfaces/hspline_files/(hspline_json|json_parts|feature)|problems/config/|problems/volumes/|problems/landmark_files/(fcsv|landmark_table|markups|picked|point_lines|read)|problems/points/point_(files|table)|problems/subject/(network_file|tissue_table)|problems/edits/edit_script|problems/face_template/template_io|problems/study/trial_folder
coverage: setup
	@cmake --preset coverage "-DSEMBLANCE_COVERAGE=$(READERS)" > /dev/null
	@cmake --build --preset coverage --target $(if $(filter .,$(COVERED)),all,$(subst |, ,$(COVERED)))
	@ctest --preset coverage -j "$$(nproc)" -R "^($(COVERED))" -E AFullDisk --quiet; \
	gcovr -r . build-coverage -j "$$(nproc)" --exclude-throw-branches --exclude-unreachable-branches -e tests/ --json build-coverage/coverage.json
	@python3 tests/coverage.py build-coverage/coverage.json "$(READERS)"

format: setup
	@git ls-files '*.h' '*.cc' | xargs clang-format -i

# All that is looked at beside the tests.
check: build headers tidy configs
	@git ls-files '*.h' '*.cc' | xargs clang-format --dry-run -Werror

# Each header compiles alone; in a build without precompiled headers most are proven by their own source.
headers: build
	@cmake --build --preset $(PRESET) --target all_verify_interface_header_sets

# clang-tidy on the sources that changed since BASE, a commit. clang cannot read the precompiled headers of g++, and
# takes its options for memory as errors.
tidy: setup
	@cmake --preset $(PRESET) -B build-tidy -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DSEMBLANCE_AMPLE_MEMORY=OFF > /dev/null
	@git diff --name-only --diff-filter=d $(BASE) -- 'surfaces/*.cc' 'interp/*.cc' 'fitting/*.cc' 'problems/*.cc' | \
	  xargs -r -n 1 -P $$(nproc) clang-tidy -p build-tidy --quiet --extra-arg=-Wno-unknown-warning-option

# Every configuration and every study is one that the program takes, with all inputs that it names; the heads' and the demo's own are not in
# this project, and published.yaml names no subject.
configs: PUBLISHED = configs/published.yaml
configs: build
	@$(BUILD)/problems/semblance check $(filter-out $(PUBLISHED),$(wildcard configs/*.yaml)) configs/fit/*.yaml configs/studies/*.yaml
	@$(BUILD)/problems/semblance check --without-inputs $(PUBLISHED) configs/heads/*.yaml configs/demo_phantom/*.yaml configs/population/*.yaml

clean:
	@rm -rf build build-debug build-sanitize build-quick build-tidy build-fuzz build-threads build-coverage build-clang build-256 build-128
