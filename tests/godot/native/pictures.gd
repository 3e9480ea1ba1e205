extends ConsacAgent
## Sees a picture that it draws itself and a number; plays itself by a rule. Episodes of three steps.

var _drawn := 0


func _init() -> void:
	observations = [ConsacEntry.box(&"number", 1, 0.0, 1000.0), ConsacEntry.image(&"eye", Vector2i(3, 2), 1)]
	actions = [ConsacEntry.box(&"push", 2), ConsacEntry.discrete(&"jump", 3)]
	max_steps = 3


func observe(into: Dictionary) -> void:
	_drawn += 1
	var pixels := PackedByteArray()
	for i in 6:
		pixels.append(_drawn % 40 + i)
	into[&"eye"] = pixels
	into[&"number"] = float(_drawn)


func heuristic(into: Dictionary) -> void:
	into[&"push"] = Vector2(0.25, -0.5)
	into[&"jump"] = steps % 3
