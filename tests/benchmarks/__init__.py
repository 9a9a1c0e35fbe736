# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks: each measures one thing, keeps raw results as JSON and renders a page of them.

`./dev bench NAME` runs one; `./dev bench` lists them. Raw results are in docs/results/data/, pages
in docs/results/. What several benchmarks need is in `common`.
"""
