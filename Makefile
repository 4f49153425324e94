# Two commands that do all the set-up on a fresh machine: `make demo` and `make test`.
PYTHON ?= python3
# Where an environment has its programs.
BIN := $(if $(filter Windows_NT,$(OS)),Scripts,bin)
# The newest torch brings gigabytes of CUDA; this one has a small CPU build. Only the tests need it.
TORCH ?= torch==2.13.0

# Which tests, in pytest's words; all of them without.
TESTS ?=

# Programs that the package has to run with.
PYTHONS ?= python3.11 python3.12 python3.13

# Tests start hundreds of processes; where this is set, each would compile every module that it imports.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test lint types audit docs package clean

demo: .venv/.installed
	.venv/$(BIN)/pcnet3d demo -o demo-run
	@echo "here: .venv/$(BIN)/pcnet3d view demo-run, or with --web in a browser"

# How many processes says tests/conftest.py; a file's tests stay in one, for they share what takes long to make. More
# threads in each would only wait for one another, and in loops that hold a core.
test: .venv-test/.installed
	OMP_NUM_THREADS=1 OMP_WAIT_POLICY=passive .venv-test/$(BIN)/python -m pytest -n auto --dist loadfile $(TESTS)

lint: .venv-test/.installed
	.venv-test/$(BIN)/ruff check .
	.venv-test/$(BIN)/ruff format --check .
	.venv-test/$(BIN)/lint-imports --no-logo --no-cache
	.venv-test/$(BIN)/pyright --pythonpath .venv-test/$(BIN)/python

# As on the systems that `make lint` is not run on, half a minute each.
types: .venv-test/.installed
	for system in Linux Windows Darwin; do \
		.venv-test/$(BIN)/pyright --pythonplatform $$system --pythonpath .venv-test/$(BIN)/python || exit 1; done

# Asks PyPI about known vulnerabilities of every installed version, and fails (--strict) where it cannot be asked.
audit: .venv-test/.installed
	.venv-test/$(BIN)/pip check
	.venv-test/$(BIN)/pip install -q pip-audit
	.venv-test/$(BIN)/pip freeze --exclude-editable | sed 's/+cpu//' > .venv-test/installed.txt
	.venv-test/$(BIN)/pip-audit --strict --no-deps --disable-pip -r .venv-test/installed.txt

# The site of the documents, the reference of the API in it, and a look at what it loads; a warning ends it.
docs: .venv-test/.installed
	rm -rf build/site
	.venv-test/$(BIN)/sphinx-build -W -q -c docs/site -d build/doctrees . build/site
	.venv-test/$(BIN)/python docs/site/reference.py build/site/api
	.venv-test/$(BIN)/python docs/site/check.py build/site
	@echo "here: build/site/index.html"

# The wheel, built from the source archive, in fresh environments with the oldest and the newest packages allowed.
package: .venv-package/.installed
	rm -rf dist
	.venv-package/$(BIN)/uv build --quiet
	@set -e; for python in $(PYTHONS); do for packages in lowest-direct highest; do \
		echo "== $$python, $$packages"; \
		env=.venv-package/$$python-$$packages; rm -rf $$env; \
		.venv-package/$(BIN)/uv venv --quiet --python $$python $$env; \
		.venv-package/$(BIN)/uv pip install --quiet --python $$env --no-build --resolution $$packages \
			-r pyproject.toml --extra c3d; \
		.venv-package/$(BIN)/uv pip install --quiet --python $$env --no-deps dist/*.whl; \
		.venv-package/$(BIN)/uv pip check --quiet --python $$env; \
		(cd $$env && $(BIN)/pcnet3d demo --force -o demo 2> demo.log || { cat demo.log; exit 1; }); \
	done; done

.venv-package/.installed:
	$(PYTHON) -m venv .venv-package
	.venv-package/$(BIN)/pip install -q uv
	touch $@

.venv/.installed: pyproject.toml
	$(PYTHON) -m venv .venv
	.venv/$(BIN)/pip install -q -e .
	touch $@

# Without compiling: of thousands of modules the tests import a few hundred, which are compiled then.
.venv-test/.installed: pyproject.toml
	$(PYTHON) -m venv .venv-test
	.venv-test/$(BIN)/pip install -q --no-compile "$(TORCH)"
	.venv-test/$(BIN)/pip install -q --no-compile -e ".[train,dev,docs]"
	touch $@

clean:
	rm -rf .venv .venv-test .venv-package build dist *.egg-info demo-run demo-run-input
