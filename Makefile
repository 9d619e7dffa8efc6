# Every target sets up its own environment; a machine needs python3 and make.
PYTHON ?= python3
EXTRAS ?= test
BIN := .venv/bin
# most modules are never imported; what is, Python compiles then
INSTALLING := --quiet --no-compile --disable-pip-version-check -c constraints.txt

.PHONY: demo check test bench mutate coverage docs dist clean

demo: .venv/ready
	$(BIN)/fringeforce reproduce saad --out demo

# Three workers keep two cores busy while tests wait for browsers, cameras and processes; four crowd
# each other out of the caches, and take a twentieth longer.  What they free of large arrays they
# keep for the next ones: new pages of memory cost a twentieth of the time.
test: .venv/ready
	MALLOC_MMAP_THRESHOLD_=268435456 MALLOC_TRIM_THRESHOLD_=536870912 \
	    OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 3 --dist loadgroup

# For use while working: types of the files that changed since the last commit, and all tests that
# are not marked slow, the other static checks among them.  What is named at the end takes long
# enough to be marked.
check: .venv/ready
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadgroup -m "not slow" \
	    --durations 5 --durations-min 2
	@changed=$$(git diff --name-only --diff-filter=d HEAD -- '*.py'); \
	[ -z "$$changed" ] || $(BIN)/pyrefly check --python-interpreter-path $(BIN)/python $$changed

bench: .venv/ready
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[bench]'
	$(BIN)/python benchmarks/record.py

docs: .venv/ready
	$(BIN)/python -m sphinx -b html -q -W --keep-going docs docs/_site
	@echo "Open docs/_site/index.html in a browser."

# A sample of small changes to the numerical packages, each of which some test should notice.
mutate: .venv/ready
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[mutation]'
	OPENBLAS_NUM_THREADS=1 $(BIN)/python tests/mutation/mutate.py

# Compiled loops leave no trace of their lines, so they count as they run interpreted: the tests of
# the packages that hold them run once more, without the compiler.  The interpreter adds up single
# precision less exactly than vectors do, which the tolerance of one test does not allow.
VECTORISED := tests/estimation/test_information.py::test_deviations_are_those_of_all_pixels_whatever_the_fringes_and_dead_ones
coverage: .venv/ready
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[coverage]'
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadgroup --cov
	OPENBLAS_NUM_THREADS=1 NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest --cov --cov-append \
	    --deselect $(VECTORISED) tests/estimation
	$(BIN)/python -m coverage report --sort=cover

dist: .venv/ready
	$(BIN)/python -m build --no-isolation

clean:
	rm -rf .venv demo dist build docs/_site docs/generated

.venv/ready: pyproject.toml constraints.txt | .venv/bin/pip
	$(BIN)/python -m pip install $(INSTALLING) -e '.[$(EXTRAS)]'
	@touch $@

# What the package itself needs, so that it can be used while the rest is installed.
.venv/plain: pyproject.toml constraints.txt | .venv/bin/pip
	$(BIN)/python -m pip install $(INSTALLING) -e .
	@touch $@

# pip of Python 3.11 takes half as long again as its successors.
.venv/bin/pip:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	    { echo "fringeforce needs Python 3.11 or newer; set PYTHON=python3.x"; exit 1; }
	@$(PYTHON) -m venv .venv || \
	    { echo "python3 cannot make environments here; on Debian: apt-get install python3-venv"; exit 1; }
	@$(BIN)/python -m pip install $(INSTALLING) --upgrade pip
