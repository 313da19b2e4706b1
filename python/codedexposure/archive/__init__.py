# SPDX-License-Identifier: LGPL-2.1-or-later
"""Decodes archives of recordings on a batch engine: codedexposure archive."""
