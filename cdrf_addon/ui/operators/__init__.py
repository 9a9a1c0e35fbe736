# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators by subject: each gathers from the context, calls, and reports."""
