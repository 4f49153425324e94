# Two commands that do all the set-up on a fresh machine: `make demo` and `make test`.
PYTHON ?= python3
# The newest torch brings gigabytes of CUDA; this one has a small CPU build. Only the tests need it.
TORCH ?= torch==2.13.0

.PHONY: demo test lint audit clean

demo: .venv/.installed
	.venv/bin/pcnet3d demo -o demo-run
	@echo "here: .venv/bin/pcnet3d view demo-run, or with --web in a browser"

test: .venv-test/.installed
	.venv-test/bin/python -m pytest

lint: .venv-test/.installed
	.venv-test/bin/ruff check .
	.venv-test/bin/ruff format --check .
	.venv-test/bin/pyright --pythonpath .venv-test/bin/python

# Asks PyPI about known vulnerabilities of every installed version, and fails (--strict) where it cannot be asked.
audit: .venv-test/.installed
	.venv-test/bin/pip check
	.venv-test/bin/pip install -q pip-audit
	.venv-test/bin/pip freeze --exclude-editable | sed 's/+cpu//' > .venv-test/installed.txt
	.venv-test/bin/pip-audit --strict --no-deps --disable-pip -r .venv-test/installed.txt

.venv/.installed: pyproject.toml
	$(PYTHON) -m venv .venv
	.venv/bin/pip install -q -e .
	touch $@

.venv-test/.installed: pyproject.toml
	$(PYTHON) -m venv .venv-test
	.venv-test/bin/pip install -q "$(TORCH)"
	.venv-test/bin/pip install -q -e ".[train,dev]"
	touch $@

clean:
	rm -rf .venv .venv-test build *.egg-info demo-run demo-run-input
