#!/bin/sh
# Builds wheel and source distribution of the last commit into dist/, installs each with what it
# requires into an environment of its own, and runs demo and tests from there (make release):
#
#     tests/clean_root.sh trixie make release
#
# Scene and tests are those of the unpacked source distribution without its package, so that only
# the installed one can be imported. Needs .venv (make setup), git and a network.
set -eu
cd "$(dirname "$0")/.."
checkout=$PWD
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

git clone -q . "$work/checkout"
rm -rf dist
.venv/bin/python -m build -q --outdir dist "$work/checkout"

for archive in dist/*.whl dist/*.tar.gz; do
    echo "== $archive"
    source=$work/source
    environment=$work/environment
    rm -rf "$source" "$environment"
    mkdir "$source"
    tar -xzf dist/*.tar.gz -C "$source" --strip-components 1
    rm -r "$source/fem_seal"
    /usr/bin/python3 -m venv --system-site-packages "$environment"
    "$environment/bin/pip" install -q --disable-pip-version-check -c .venv/debian.txt \
        "$archive" pytest hypothesis
    (
        cd "$source"
        "$environment/bin/fem-seal" run demos/scenes/first.toml
        "$environment/bin/python" -m pytest -q -p no:cacheprovider tests/flow/test_closed_forms.py \
            tests/contact/test_contact_known_answers.py
        "$environment/bin/python" -c "import fem_seal; print(fem_seal.__version__, fem_seal.__file__)"
    )
    echo "== $archive: demo and tests ran"
done
