PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: docs pictures demo demo-control test test-most test-large lint generate control bench corpus opensim crash random fuzz same mutate report clean
.PHONY: ship sums pythons licences calls embedded exports identity release rehearsal api

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt torch
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[all,test,lint]'
	touch $@

demo: $(READY)
	$(BIN)/linkwise generate planar3 --out out
	$(BIN)/linkwise generate puma560 --out out
	$(BIN)/linkwise check out/planar3
	$(BIN)/linkwise check out/puma560
	$(BIN)/python tests/tools/demo.py out
	$(BIN)/linkwise motion --out out/motions
	$(BIN)/linkwise analyze out/motions/recorded.csv --robot out/planar3 --out out/recorded --cutoff 4 --figure paper --figure shares
	$(BIN)/linkwise analyze out/motions/simulated.csv --robot out/planar3 --out out/simulated --figure paper --figure shares
	@echo "Fig. 5-9: out/recorded/paper.png   Fig. 10-14: out/simulated/paper.png   page: out/simulated/report.html"

generate: $(READY)
	$(BIN)/linkwise generate planar3 --out generated
	$(BIN)/linkwise generate puma560 --out generated
	$(BIN)/linkwise generate torso --out generated

# The documentation as a site: out/docs/index.html leads to the newest of the versions beside it. A warning fails it.
docs: $(READY)
	$(BIN)/python docs/versions.py out/docs

# What the pages of the documentation and the notebooks show, run; their pictures drawn anew.
pictures: $(READY)
	$(BIN)/python tests/tools/pages.py
	$(BIN)/python tests/tools/notebooks.py
	$(BIN)/python docs/pictures/draw.py

# The hashes of what `linkwise example` copies, after a change of it.
sums:
	cd examples/cases && LC_ALL=C sha256sum */*.* > SHA256SUMS

# The figure and the tables of docs/control.md: what is cancelled at the root, and what a loop at 1 kHz keeps.
control: $(READY)
	$(BIN)/python tests/tools/control_root.py --out docs
	$(BIN)/python tests/tools/control_stance.py
	$(BIN)/python tests/numeric/finite_rate_tables.py --out out/control

# Panda pushed at its hand in MuJoCo: limp, soft and stiff.
demo-control: $(READY)
	$(BIN)/python tests/tools/demo_control.py --out out/control

# What compilers made of what, which later runs find again; Python's too, which every process that a test starts reads.
KEPT = LINKWISE_TEST_CACHE=$(CURDIR)/.cache/tests TORCHINDUCTOR_CACHE_DIR=$(CURDIR)/.cache/inductor PYTHONDONTWRITEBYTECODE=

# Two files of tests at a time; the rooms with most robots begin in processes of their own, as memory is bounded.
LARGE = tests/numeric tests/runtime
test: test-most test-large
test-most: $(READY)
	$(KEPT) $(BIN)/python -m pytest --numprocesses 2 --dist loadfile -m "not (ship or browser)" $(LARGE:%=--ignore=%)
test-large: $(READY)
	$(KEPT) $(BIN)/python -m pytest --numprocesses 2 --dist loadfile -m "not (ship or browser)" $(LARGE)

# What leaves the house, as others get it: pages in a browser, wheels, CMake's projects, exports, other processors and
# systems; minutes. Three files at a time for two cores, as some wait for the browser or for compilers.
ship: $(READY)
	$(KEPT) $(BIN)/python -m pytest --numprocesses 3 --dist loadfile -m "ship or browser"

# What could be wrong without a test, or without `linkwise check`, noticing: hours. Without the latter, MINUTES=30 ends
# earlier, and the next run goes on from there; ONLY="dynamics runtime/rule" takes rooms.
mutate: $(READY)
	$(if $(MINUTES)$(ONLY),,$(BIN)/python tests/mutation/emitted.py --out out/mutate)
	$(BIN)/python tests/mutation/run.py --out out/mutate $(if $(MINUTES),--minutes $(MINUTES)) $(if $(ONLY),--only $(ONLY))

lint: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

# The paper's cost-reduction figure.
report: $(READY)
	$(BIN)/linkwise report reduction --graphs --out out/report

# Every .osim of a folder beside OpenSim: make opensim MODELS=folder
opensim: $(READY)
	$(BIN)/python tests/tools/opensim_folder.py $(MODELS)

# Every real robot at hand, beside Pinocchio, and whether `linkwise check` calls each right: half an hour.
corpus: $(READY)
	$(BIN)/python tests/tools/corpus.py --check --out out/corpus
	$(BIN)/python tests/tools/corpus.py --kernel loops --out out/corpus-loops

# Every call of docs/exports.md compiled, exported and under onnxruntime: half an hour.
exports: $(READY)
	$(BIN)/python tests/tools/exports.py --out out/exports

# `generate` and `analyze` killed at each system call that touches files, which needs strace, and `study` interrupted: half an hour.
crash: $(READY)
	$(BIN)/python tests/tools/crash.py
	$(BIN)/python tests/tools/interrupts.py

# 200 random robots of up to 15 joints, each link beside Pinocchio: twenty minutes.
random: $(READY)
	$(BIN)/python tests/numeric/random_robots.py --count 200

# Broken robots, logs, manifests and command lines: an hour.
fuzz: $(READY)
	$(BIN)/python tests/fuzz/run.py --minutes 60

# The same bytes whatever the surroundings, one change at a time: minutes.
same: $(READY)
	$(BIN)/python tests/tools/same_bytes.py

# `make test ship` in Python 3.12, 3.13 and 3.14, where these are: an hour each, and gigabytes where torch comes with what
# GPUs need; ONLY="3.12 3.14" takes some.
pythons: $(READY)
	$(BIN)/python tests/tools/pythons.py $(ONLY:%=--only %)

# Authors, keywords, classifiers and URLs of pyproject.toml, brought to all other files that have some.
identity: $(READY)
	$(BIN)/python tests/tools/identity.py

# The tables of docs/licences.md.
licences: $(READY)
	$(BIN)/python tests/tools/licences.py

# The tables of docs/calls.md.
calls: $(READY)
	$(BIN)/python tests/tools/call_page.py

# All that a release hands out, in out/release, up to the upload; release/README.md says the steps. `make rehearsal` makes
# the same of the last commit at any time, and tells what speaks against a release.
release: $(READY)
	$(BIN)/python -m release

rehearsal: $(READY)
	$(BIN)/python -m release --rehearse

# The public face of this version, with which later releases are compared: release/api/VERSION.json.
api: $(READY)
	$(BIN)/python -m release.recorded_faces

# Speed beside Pinocchio and CasADi, reports and motions at length: minutes, on a quiet machine.
bench: $(READY)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[bench]'
	$(BIN)/python tests/benchmarks/bench_speed.py --out out/bench
	$(BIN)/python tests/benchmarks/growth.py --out out/bench
	$(BIN)/python tests/benchmarks/bench_report.py
	$(BIN)/python tests/benchmarks/bench_analysis.py
	$(BIN)/python tests/benchmarks/bench_motion.py million generated/planar3
	$(BIN)/python tests/benchmarks/bench_motion.py ten-hours generated/torso
	$(BIN)/python tests/benchmarks/bench_study.py
	$(BIN)/python tests/benchmarks/bench_energies.py
	$(BIN)/python tests/benchmarks/bench_tied.py

# The table of docs/embedded.md: stack and instructions on a Cortex-M that QEMU plays.
embedded: $(READY)
	$(BIN)/python tests/tools/cortex_m.py

clean:
	rm -rf out .cache $(VENV)
