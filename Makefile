# poolcal's front door. `make help` lists what there is; every target sets itself up first.
# Variables are taken from make's command line alone, never from the environment.
# The program decides by content what is out of date and exits with its own statuses; make turns each failure into 2.

SESSION  =
CONFIG   =
RUN      =
FLEET    =
A        =
B        =
JOBS     =
OVERWRITE =
SEED     = 1

POOLCAL := .venv/bin/poolcal
PY      := .venv/bin/python
SETUP   := .venv/.setup
STAGES  := ingest georeference segment fit_planes angle_iterate offsets adjust report
DEMO    := runs/demo-session

.DEFAULT_GOAL := help
.SUFFIXES:
MAKEFLAGS += --no-builtin-rules
unexport PYTHONDONTWRITEBYTECODE # containers set it: then each start of the program, some hundred in test, compiles it
.PHONY: docs help packages setup setup-visual demo calibrate repeat stages diff view test thorough lint format bench pictures montecarlo clean

help: ## this list
	@sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/  make \1|\2/p' Makefile | awk -F'|' '{printf "%-20s %s\n", $$1, $$2}'
	@echo 'Variables: SESSION CONFIG RUN JOBS SEED, e.g. make calibrate SESSION=dir CONFIG=configs/pool.yaml RUN=runs/name'

setup: $(SETUP) ## .venv with everything; does nothing the second time
$(SETUP): pyproject.toml constraints.txt tools/setup.sh
	@tools/setup.sh

setup-visual: $(SETUP) ## a browser and a Vulkan driver, for tests that look at pages and recordings
	@tools/setup_visual.sh

# --- calibrating -----------------------------------------------------------------------------------------------------
demo: $(DEMO)/.simulated ## simulate a pool session, calibrate it, compare with its truth
	$(POOLCAL) run $(DEMO) --config $(DEMO)/pool.yaml --run runs/demo
	$(POOLCAL) compare runs/demo $(DEMO).truth.json
	@echo 'Look next at runs/demo/report/report.html, and at the recordings: make view RUN=runs/demo'

$(DEMO)/.simulated: $(SETUP) $(shell find pipeline/simulation configs/scenarios -name '*.py' -o -name '*.yaml')
	@rm -rf $(DEMO) $(DEMO).truth.json
	$(POOLCAL) simulate $(DEMO) --seed $(SEED) >/dev/null
	@touch $@

GIVEN = $(foreach name,SESSION CONFIG RUN,$(if $($(name)),,$(error $(name)= is missing: make $@ SESSION=dir CONFIG=configs/pool.yaml RUN=runs/name)))

calibrate: $(SETUP) ## all stages that are out of date: SESSION= CONFIG= RUN=
	@:$(GIVEN)
	$(POOLCAL) run '$(SESSION)' --config '$(CONFIG)' --run '$(RUN)' $(if $(JOBS),--jobs $(JOBS)) $(if $(OVERWRITE),--overwrite)

repeat: $(SETUP) ## all sessions of a list that are out of date, then one table: FLEET=
	@:$(if $(FLEET),,$(error FLEET= is missing: make repeat FLEET=configs/fleet.yaml))
	$(POOLCAL) repeat '$(FLEET)' $(if $(JOBS),--jobs $(JOBS))

diff: $(SETUP) ## compare two runs: A= B=
	@:$(foreach name,A B,$(if $($(name)),,$(error $(name)= is missing: make diff A=runs/x B=runs/y)))
	$(POOLCAL) diff '$(A)' '$(B)'

view: $(SETUP) ## open a run's recordings in the Rerun viewer: RUN=
	@:$(if $(RUN),,$(error RUN= is missing: make view RUN=runs/x))
	$(POOLCAL) view '$(RUN)'

# The same, one rule a stage with real files as targets. (Paths with blanks: make cannot have them as targets;
# `make calibrate` takes them.)
ifeq ($(words $(SESSION) $(CONFIG) $(RUN)),3)
stages: $(RUN)/report/manifest.json ## the same by files: one rule a stage, nothing runs when nothing is newer

# Every file of the program is watched: a stage's module alone holds little of what it computes with. The program decides
# by content which stages a change concerns, and touches the manifests of the others.
SOURCES := $(shell find pipeline stages configs/instruments -name '*.py' -o -name '*.html' -o -name '*.yaml')

define STAGE_RULE
$(RUN)/$(1)/manifest.json: $(SOURCES) $(2)
	$$(POOLCAL) stage $(1) $(RUN) --session $(SESSION) --config $(CONFIG) $$(if $$(JOBS),--jobs $$(JOBS))
endef
RAW := $(filter-out %/.simulated,$(shell find $(SESSION) -type f 2>/dev/null))
$(eval $(call STAGE_RULE,ingest,$(SETUP) $(CONFIG) $(SESSION)/session.yaml $(RAW)))
$(eval $(call STAGE_RULE,georeference,$(RUN)/ingest/manifest.json))
$(eval $(call STAGE_RULE,segment,$(RUN)/georeference/manifest.json))
$(eval $(call STAGE_RULE,fit_planes,$(RUN)/segment/manifest.json))
$(eval $(call STAGE_RULE,angle_iterate,$(RUN)/fit_planes/manifest.json))
$(eval $(call STAGE_RULE,offsets,$(RUN)/angle_iterate/manifest.json))
$(eval $(call STAGE_RULE,adjust,$(RUN)/offsets/manifest.json))
$(eval $(call STAGE_RULE,report,$(RUN)/adjust/manifest.json))
.PRECIOUS: $(STAGES:%=$(RUN)/%/manifest.json)
else
stages:
	@:$(GIVEN)$(error make stages takes no paths with blanks: use make calibrate)
endif

packages: $(SETUP) ## the wheel and all it needs in runs/packages, for machines without internet or repository
	rm -rf build runs/packages
	$(PY) -m pip --disable-pip-version-check wheel -q -c constraints.txt -w runs/packages .
	rm -rf build

# --- developing --------------------------------------------------------------------------------------------------------
lint: $(SETUP) ## style, types, imports
	.venv/bin/ruff check .
	.venv/bin/mypy
	.venv/bin/lint-imports --no-logo

format: $(SETUP) ## what ruff can correct by itself
	.venv/bin/ruff check --fix-only .

test: lint ## lint, then every test
	$(PY) -m pytest -n 2 --dist loadfile -q

thorough: lint ## every test, with more draws, kills and damaged files than a usual run has
	POOLCAL_THOROUGH=1 $(PY) -m pytest -n 2 --dist loadfile -q

bench: $(SETUP) ## time and memory of whole runs of several sizes, against bare decoding
	$(PY) -m tools.bench
	$(PY) -m tools.finding_speed runs/bench/session-large --repeats 7

pictures: $(DEMO)/.simulated ## the documents' pictures, anew (after make setup-visual)
	$(POOLCAL) run $(DEMO) --config $(DEMO)/pool.yaml --run runs/demo
	$(PY) -m tools.pictures runs/demo docs/pictures

docs: $(SETUP) ## the documents as a site in runs/site, to be read without a network
	@$(PY) -c 'import mkdocs, material' 2>/dev/null || $(PY) -m pip --disable-pip-version-check install -q -c constraints.txt -e '.[docs]'
	NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build -q --strict

montecarlo: $(SETUP) ## many simulated sessions: are the predicted sigmas true?
	$(PY) -m tools.montecarlo
	$(PY) -m tools.mistakes --seeds 25
	$(PY) -m tools.residual_tests
	$(PY) -m tools.laser
	$(PY) -m tools.laser --drift "within 10 s" --sessions 100
	$(PY) -m tools.laser --drift "within 30 s" --sessions 100
	$(PY) -m tools.laser_pairs
	$(PY) -m tools.two_heads
	$(PY) -m tools.stress
	$(PY) -m tools.course_campaigns > docs/accuracy/courses.md
	$(PY) -m tools.place_campaign > docs/accuracy/places.md
	$(PY) -m tools.place_campaign --rough --sessions 75 > docs/accuracy/walls.md
	$(PY) -m tools.found_and_drawn --sessions 20 > docs/accuracy/found-and-drawn.md
	$(PY) -m tools.patch_campaign > docs/accuracy/patch.md
	$(PY) -m tools.accuracy
	$(PY) -m tools.patent_forms docs/patent.md

clean: ## remove the demo and the tools' caches; results of other runs stay
	rm -rf runs/demo runs/demo-session runs/demo-session.truth.json
	rm -rf .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
