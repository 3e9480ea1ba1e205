extends ConsacAgent
## One of the agents in test_native.py that leave for good as their only episode ends, after five steps; another one comes
## for each. The first one stays, and so has one episode after another.

const HOW := "WAY"

var place := 0.0


func _init() -> void:
	observations = [ConsacEntry.box(&"place", 1)]
	actions = [ConsacEntry.box(&"move", 1)]
	episode_ended.connect(_when_ended)


func reset(_episode_seed: int) -> void:
	place = rng.randf()


func observe(into: Dictionary) -> void:
	into[&"place"] = place


func act(chosen: Dictionary) -> void:
	place = clampf(place + chosen[&"move"], -1.0, 1.0)


func judge() -> void:
	add_reward(1.0)
	if steps < 4:  # this step is not among them yet
		return
	end_episode()
	if HOW == "judge" and name != &"Agent":
		queue_free()


func _when_ended(_total_reward: float, _steps: int) -> void:
	var scene := driven_by.get_parent()
	if name == &"Agent":
		if scene.get_child_count() == 2:  # the sync and this one
			_send_another(scene)
		return
	match HOW:
		"signal":
			queue_free()
		"parent":
			get_parent().queue_free()
		"removed":
			get_parent().remove_child(self)
			queue_free()
	_send_another(scene)


func _send_another(scene: Node) -> void:
	var body := Node3D.new()
	body.add_child(get_script().new())
	scene.add_child(body)
