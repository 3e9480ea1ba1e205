"""Node table, documents, graphs and pictures of the Unreal plugin, all from its headers. Used by tools/unreal_docs.py."""
