# make demo   install what is missing and run the first scene
# make test   install what is missing and run the tests, on all cores
# make quick  the same for contact, film, mesh, flow, scenes and pages alone
# make lint   install what is missing and check style and types
# make docs   install what is missing and build the pages into docs/_build; warnings are errors
# make links  the same, and ask the other end of every external link; needs the internet
# make validation   compute docs/validation.md and its figure; make peers before it adds other codes
# make peers  install other codes beside this one in .venv-peers and run them side by side
# make setup  install what is missing
# make debian13, make sid   run demo and tests on that Debian, in a clean root (as root)
# make release   build wheel and source distribution into dist/, run demo and tests from each
# make image   build the image of Dockerfile from Debian's packages alone, and run it (as root)
.PHONY: demo test quick lint validation peers docs links setup clean debian13 sid release image

# One thread a process, caches inside the checkout, compiled modules kept, EGL instead of X, mpirun
# also as root.
export OMP_NUM_THREADS ?= 1
export XDG_CACHE_HOME := $(CURDIR)/.cache
export VTK_DEFAULT_OPENGL_WINDOW ?= vtkEGLRenderWindow
export OMPI_MCA_btl ?= ^tcp
export OMPI_MCA_mpi_yield_when_idle ?= 1
export OMPI_ALLOW_RUN_AS_ROOT = 1
export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM = 1
unexport PETSC_DIR SLEPC_DIR PYTHONPATH PYTHONHOME PYTHONDONTWRITEBYTECODE

demo: .venv/ready
	.venv/bin/fem-seal run demos/scenes/first.toml --out results/first --overwrite
	@echo
	@echo "next       open results/first/flow.png: where it leaks, and through which channels"
	@echo "           .venv/bin/fem-seal report results/first    one page with numbers and pictures"
	@echo "           .venv/bin/fem-seal new YOUR_MAP            a scene for your own heights: docs/guide/first-verdict.md"
	@echo "           a whole seal: docs/guide/ring.md; from Python: docs/guide/python.md"

# A worker that has nothing left to do takes over tests of another.
PYTEST = .venv/bin/python -m pytest -n $(shell env -u OMP_NUM_THREADS nproc) --dist worksteal
QUICK = contact field_file film finite_difference flow mesh scene theory test_architecture.py \
	test_docs.py test_docstrings.py

test: .venv/ready
	$(PYTEST)

quick: .venv/ready
	$(PYTEST) -m "not slow and not mpi and not render" $(addprefix tests/,$(QUICK))

lint: .venv/ready
	.venv/bin/ruff check .
	.venv/bin/mypy

validation: .venv/ready
	.venv/bin/python tests/validation/validation_page.py docs/validation.md

# Two environments: the petsc4py of Debian, which reynoldsflow uses, wants an older numpy.
peers: .venv/ready
	python3 -m venv .venv-peers/contact
	.venv-peers/contact/bin/pip install -q --disable-pip-version-check tamaas==2.9.0 ContactMechanics==1.8.3
	/usr/bin/python3 -m venv --system-site-packages .venv-peers/flow
	.venv-peers/flow/bin/pip install -q --disable-pip-version-check -c .venv/debian.txt reynoldsflow==0.1.3
	.venv/bin/python tests/validation/validation_rows.py tamaas contact-mechanics reynoldsflow
	.venv/bin/python tests/benchmarks/contact_peers.py --sizes 256 --peers tamaas contact-mechanics
	.venv/bin/python tests/benchmarks/flow_peer.py --n 128 --area 0.2

docs: .venv/ready
	.venv/bin/pip install -q --disable-pip-version-check -c .venv/debian.txt -e '.[docs]'
	.venv/bin/python -m sphinx -W --keep-going -b html docs docs/_build

links: docs
	.venv/bin/python -m sphinx -b linkcheck docs docs/_build/links

setup: .venv/ready

debian13:
	tests/clean_root.sh trixie

sid:
	tests/clean_root.sh sid

release: .venv/ready
	tests/release.sh

image:
	tests/image.sh

# setup.sh leaves the place of the checkout in .venv/ready: after a move the environment is mended.
ifneq ($(shell cat .venv/ready 2>/dev/null),$(shell pwd -P))
.PHONY: .venv/ready
endif
.venv/ready: setup.sh pyproject.toml
	./setup.sh

clean:
	rm -rf .venv .cache results dist
