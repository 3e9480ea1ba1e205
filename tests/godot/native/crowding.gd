extends ConsacAgent
## One of the agents that come and go in test_native.py: each lives for three episodes and then leaves
## for good; the first one brings newcomers, more than there is room for.

var place := 0.0
var lives := 3


func _init() -> void:
	observations = [ConsacEntry.box(&"place", 1)]
	actions = [ConsacEntry.box(&"move", 1)]
	max_steps = 5


func reset(_episode_seed: int) -> void:
	lives -= 1
	place = rng.randf()


func observe(into: Dictionary) -> void:
	into[&"place"] = place


func act(chosen: Dictionary) -> void:
	place = clampf(place + chosen[&"move"], -1.0, 1.0)


func judge() -> void:
	add_reward(-absf(place))
	if name == &"Agent":
		if get_parent().get_child_count() < 7:  # the sync, this one and five: one more than there is room for
			get_parent().add_child(get_script().new())
	elif lives < 0:
		queue_free()
