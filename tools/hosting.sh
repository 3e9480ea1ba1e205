#!/usr/bin/env bash
# What a code host does with the repository: the site is built and its links are checked, workflow files and the Dockerfile are linted.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/setup.sh site
.venv-site/bin/python tools/build_site.py
node tools/check_workflows.mjs build/site-tools .github/workflows/*.yml
.venv-site/bin/hadolint Dockerfile
echo "hosting: the site is whole, workflows and Dockerfile have no fault that actionlint and hadolint know"
