# To begin with: `make view`, `make demo`, `make test`. Each sets everything up by itself.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SWEEPS := same_time preconditioning resolution target_function acceptance histogram dimensions specular chess cnsr anf denoising sampling \
	ours_same_time ours_preconditioning ours_resolution ours_target_function ours_acceptance ours_histogram ours_dimensions \
	ours_specular ours_chess ours_cnsr ours_anf
BUDGET ?= small
CLOCK ?= model
OPTIONS ?=
SCENE ?= living-room
.PHONY: help setup demo view test report docs lint smoke browser wheel benchmark gpu doctor clean

help: ## list the commands
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 14

setup: $(VENV)/.complete ## virtual environment, pinned dependencies, libLLVM, AlexNet for LPIPS (244 MB; LPIPS=no: without)

$(VENV)/.complete: pyproject.toml constraints.txt tools/setup.sh
	@PYTHON=$(PYTHON) VENV=$(VENV) sh tools/setup.sh
	@touch $@

demo: setup ## train ours, the paper's method and uniform sampling, compare them: 15 minutes
	@$(BIN)/python -m ngi.train -m +sweeps=demo; status=$$?; \
	$(BIN)/python -m analysis.report outputs/demo && exit $$status

view: setup ## trained networks in the browser: SCENE=living-room|sphere-caustic|veach-egg
	@$(BIN)/ngi view run=scenes/$(SCENE)/network

test: setup ## linter, type checker, all tests, smoke run on real renders
	@$(MAKE) --no-print-directory --jobs=3 lint smoke browser
	@OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -n $$(($$(nproc) + 1)) --maxprocesses 4 --dist loadfile --no-loadscope-reorder

lint: setup
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy

smoke: setup
	@rm -rf outputs/smoke
	@$(BIN)/python -m ngi.train -m +sweeps=smoke
	@$(BIN)/python -m ngi.train -m +sweeps=acceptance budget=smoke seed=0
	@$(BIN)/python -m analysis.report outputs/smoke

browser:
	@sh tools/browser.sh

report: setup ## all sweeps at BUDGET=smoke|small|paper, CLOCK=model|wall: what is missing; then the report
	@failed=0; for sweep in $(SWEEPS); do \
	{ [ $(CLOCK) = wall ] || $(BIN)/ngi costs -m +sweeps=$$sweep budget=$(BUDGET) \
	hydra/launcher=basic $(filter-out hydra/launcher=% hydra.launcher.%,$(OPTIONS)); } && \
	$(BIN)/python -m ngi.train -m +sweeps=$$sweep budget=$(BUDGET) budget.clock=$(CLOCK) $(OPTIONS) \
	|| failed=1; done; \
	$(BIN)/python -m analysis.report \
	outputs/$(BUDGET)$(if $(filter model,$(CLOCK)),-model-clock) && exit $$failed

docs: setup ## the documentation as a site in build/site, with warnings as errors
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict
	@echo "written to build/site/index.html; with search: python3 -m http.server -d build/site"

wheel: setup ## the program as one file in build/wheel; a short run from it, outside the repository
	@rm -rf build/wheel build/installed build/outputs
	@$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir build/wheel .
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-compile \
		--target build/installed build/wheel/*.whl
	@cd build && export PYTHONPATH=$(CURDIR)/build/installed && \
	../$(BIN)/python -c 'import ngi, sys; sys.exit("build/installed" not in ngi.__file__)' && \
	../$(BIN)/python -m ngi.train scene=mirror budget=smoke && \
	../$(BIN)/python -m analysis.report outputs/smoke

benchmark: setup ## speed as ratios, with the machine's own limits measured beside: 15 minutes
	@$(BIN)/ngi benchmark

gpu: setup ## everything there is to find out on a GPU; goes on where it stopped: OPTIONS='--minutes 10'
	@$(BIN)/ngi gpu-check $(OPTIONS)

doctor: setup ## what this machine has, and how to get what is missing
	@$(BIN)/ngi doctor

clean: ## delete the virtual environment; results stay
	rm -rf $(VENV)
