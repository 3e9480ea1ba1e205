"""Checks an Unreal plugin by its text alone, where no Unreal can be installed. Used by tools/unreal_lint.py."""
