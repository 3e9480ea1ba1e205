class_name ConsacStandstill
extends RefCounted
## Stops a world without stopping its window, by a pause of the scene tree, and tells that from a pause of the game's own.

## Whether it is stopped here.
var held := false
## Whether the game has paused it.
var paused := false

var _was_paused := false


## Stops the world, or lets it go on where it is stopped.
func hold(tree: SceneTree, wanted: bool) -> void:
	held = wanted
	if wanted:
		_was_paused = tree.paused
		tree.paused = true
	else:
		tree.paused = _was_paused


## Whether the game has paused, or goes on, since the last call.
func notices(tree: SceneTree) -> bool:
	var now := tree.paused and not held
	if now == paused:
		return false
	paused = now
	return true
