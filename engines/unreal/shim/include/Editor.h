#pragma once
class UEditorEngine;
/// The editor; none in a game.
extern UEditorEngine* GEditor;
