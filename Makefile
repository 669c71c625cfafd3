# The commands of this repository. Each sets up what it needs (tools/environment.sh) and takes more arguments in ARGS:
#     make up ARGS='--pace fast --for 20s'
#     make test ARGS='tests/laws -x'

PACKAGES := analysis capture cli client common console deployment door fitting gateways kernels launcher library node protocol rendering runtime simulation supervisor vhub world
PYTHON := .venv/bin/python
SEEDS ?= 100
FILE ?= deploy/table.yaml
N ?=
SEED ?= 17

# Where Python is told to write no bytecode, each process compiles all of foosim when it starts: a third of its start.
export PYTHONDONTWRITEBYTECODE :=

# Two workers more than cores, since tests of real processes wait for these; at most 8. The shell's PYTHONPATH (ROS sets
# one) would load other people's pytest plugins.
WORKERS := $(shell echo $$(($$(nproc) < 7 ? $$(nproc) + 2 : 8)))
PYTEST := PYTHONPATH= $(PYTHON) -m pytest --numprocesses $(WORKERS)

.PHONY: help up test slow play minutes swarm swarm-gate faults fuzz stats numbers components corpus robots machines lint page pictures yarp bench compiled clean environment checks second

help:
	@echo 'make up      run the football table on two nodes (ARGS: options of foosim up)'
	@echo 'make test    lint, type check and all tests (ARGS: options of pytest)'
	@echo 'make slow    tests of processes on a machine made slow: each start takes 7 s longer, all cores are busy'
	@echo 'make play    minutes of the table as deployed: goals, hand-overs, matches of its players; law 1 by further seeds'
	@echo 'make minutes minutes of the table under a thousand faults each: no digest changes; takes hours (ARGS: -k NAME)'
	@echo 'make swarm   runs under random faults, by seed (SEEDS=100; FILE: a deployment; ARGS: --seed N, --json)'
	@echo 'make faults  faults on real processes at random times, with their figures (N=20; ARGS: --seed S, --only KIND)'
	@echo 'make fuzz    hostile bytes on every channel and in every file (N=200000 each; SEED=17; ARGS: -k NAME)'
	@echo 'make stats   the links against their laws, at full size, by a seed that it prints (SEED=n repeats one)'
	@echo 'make numbers the bits and errors of elementary functions, the statistics of noise, over millions of values'
	@echo 'make components   each component type in a world of its own: the laws, by several seeds, and settings at their limits'
	@echo 'make corpus  public robots of any size: each is read or refused as the table has it, and runs as proposed'
	@echo 'make swarm-gate  for each planted bug, the first seed that finds it (ARGS: names, --seeds N, --jobs N)'
	@echo 'make machines  further cuts between machines: needs root, see docs/how-to/testing.md'
	@echo 'make lint    ruff and mypy alone'
	@echo 'make page    lint and type check the page of the console, and bundle it into console/www: needs npm'
	@echo 'make pictures  the pictures of the docs, from runs in Chromium: needs chromium (ARGS: names of pictures)'
	@echo 'make yarp    build the programs of YARP, once: tests of its gateway use them where they are'
	@echo 'make second  the part of the tests that takes a minute, on the newest Python of 3.12 to 3.14 that is found'
	@echo 'make compiled  .venv-compiled: foosim with its hot path compiled, as pip installs it where a C compiler is'
	@echo 'make bench   measure speed, latency and throughput of that (ARGS: options of the bench)'
	@echo 'make clean   remove environments, caches and builds; captures stay'

# A run in the background has no console of its own: `foosim view` shows it.
up: environment
	@.venv/bin/foosim up deploy/table.yaml $(if $(filter --detach,$(ARGS)),,--console) $(ARGS)

play: environment
	@$(PYTEST) -m campaign tests/simulation/test_a_minute_of_play.py tests/library/test_matches.py tests/laws $(ARGS)

minutes: environment
	@$(PYTEST) -o timeout=0 -m campaign tests/simulation/test_swarm.py $(ARGS)

machines: environment
	@$(PYTEST) -m campaign tests/wire/test_machines.py tests/wire/test_ssh.py $(ARGS)

# Compiling takes as long as some hundred seeds: it pays for more.
MANY := $(shell [ $(SEEDS) -ge 1000 ] && echo many)
swarm: $(if $(MANY),compiled,environment)
	@.venv$(if $(MANY),-compiled)/bin/python -m tests.swarm $(FILE) --seeds $(SEEDS) $(ARGS)

faults: environment
	@$(PYTHON) -m tests.faults.campaign --count $(or $(N),20) $(ARGS)

# Tests that take an hour are no longer hung than those that take a second.
fuzz: environment
	@$(PYTEST) -o timeout=0 tests/laws/test_fuzz.py tests/laws/test_fuzz_files.py --fuzz-payloads $(or $(N),200000) --fuzz-seed $(SEED) $(ARGS)

# A seed that nobody has chosen, unless somebody has.
stats: environment
	@seed=$(if $(filter file,$(origin SEED)),$$(od -An -N3 -tu4 /dev/urandom | tr -d ' '),$(SEED)); \
	echo "make stats SEED=$$seed repeats this"; \
	$(PYTEST) -o timeout=0 tests/links --links-full --links-seed $$seed $(ARGS)

numbers: environment
	@$(PYTEST) -o timeout=0 -m campaign tests/common $(ARGS)

components: environment
	@$(PYTEST) -o timeout=0 -m campaign tests/components $(ARGS)

corpus: robots
	@$(PYTEST) -o timeout=0 -m 'campaign or not campaign' tests/corpus $(ARGS)

# Public robots, 131 MB, once. Where they cannot be had, tests that read them are skipped; with CI set they fail.
robots: environment
	@pin=$$(sed -n 's/^corpus = \["\(.*\)"\]/\1/p' pyproject.toml) && \
	$(PYTHON) -c 'import sys; from importlib.metadata import version as v; sys.exit(sys.argv[1] != "example-robot-data==" + v("example-robot-data"))' \
	"$$pin" 2>/dev/null || PYTHONPATH= $(PYTHON) -m pip install --quiet --disable-pip-version-check "$$pin" || \
	echo 'The tests run without public robots.'

swarm-gate: environment
	@$(PYTHON) -m tests.gate.search $(ARGS)

# Last in it is pytest, so that its summary ends the output.
test: $(if $(CI),checks,lint) robots
	@$(PYTEST) --durations 20 $(ARGS)

# The type checker has one core, the second Python the other.
checks: environment
	@$(MAKE) --no-print-directory --jobs 2 --output-sync=target lint second

# What says the most in half a minute of processor time: numbers, frames, islands, clients, deployments, the world on 1 and
# on 3 nodes with losses, its capture simulated and judged again, commands as typed, processes.
LAW := tests/laws/test_one_world.py::test_nodes_moves_losses_and_a_bad_bus_give_the_same_world
SECOND := tests/common tests/client/test_core.py tests/client/test_jobs.py tests/client/test_player.py \
	tests/runtime/test_loop.py tests/runtime/test_journal.py \
	tests/deployment/test_yaml.py tests/deployment/test_engine_lacks.py tests/cli/test_yard.py \
	tests/world/test_frame.py tests/world/test_islands.py tests/world/test_urdf_model.py \
	tests/laws/test_island_engines.py tests/physics/test_rigid_drive.py '$(LAW)[7_0-workshop]' '$(LAW)[7_0-living]'
second: environment
	@sh tools/second.sh $(SECOND)

slow: environment
	@$(PYTEST) --slow-start 7 --load $$(nproc) tests/wire $(ARGS)

lint: environment
	@$(PYTHON) -m ruff check .
	@mkdir -p .typecheck/foosim
	@for package in $(filter-out door,$(PACKAGES)); do ln -sfn ../../$$package .typecheck/foosim/$$package; done
	@ln -sfn $(patsubst %,../../%,$(wildcard door/*.py door/py.typed)) .typecheck/foosim
	@$(PYTHON) -m mypy .typecheck/foosim tests examples $(wildcard bench docs/*.py)

# What is checked in is what this makes: tests/console/test_page_bundle.py compares.
page:
	@sh tools/page.sh check
	@sh tools/page.sh build console/www

# What is checked in is what this makes. Runs and browser leave the processor to others.
pictures: environment
	@nice $(PYTHON) -m docs.pictures $(ARGS)

yarp: environment
	@sh tools/yarp.sh

bench: compiled
	@.venv-compiled/bin/python -m bench $(ARGS)

compiled: environment
	@sh tools/compiled.sh $(PACKAGES)

environment:
	@sh tools/environment.sh

clean:
	rm -rf .venv .venv-uv .venv-second .venv-compiled .yarp .typecheck .page .mypy_cache .pytest_cache .ruff_cache .hypothesis build dist *.egg-info
	find $(wildcard $(PACKAGES) tests bench) -type d -name __pycache__ -prune -exec rm -rf {} +
