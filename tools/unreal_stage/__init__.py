"""Puts the engine-neutral parts into the Unreal plugin. Used by tools/stage_unreal.py."""
