extends SceneTree
## Prints the engine's settings before, during and after a session of the road, for test_wire.py.


func _initialize() -> void:
	_run.call_deferred()


func _run() -> void:
	var world: Node = load("res://examples/road/road.tscn").instantiate()
	var sync: ConsacSync = world.get_node("ConsacSync")
	_say("before")
	sync.session_ended.connect(func(_fault: String) -> void: _say("after"))
	sync.session_began.connect(func() -> void: _say("during"))
	root.add_child(world)
	await sync.session_ended
	await physics_frame
	world.queue_free()
	await physics_frame
	_say("gone")
	quit()


func _say(when: String) -> void:
	print(when, ": ", [Engine.max_fps, Engine.physics_ticks_per_second, Engine.time_scale,
			Engine.max_physics_steps_per_frame, Engine.physics_jitter_fix,
			OS.low_processor_usage_mode, OS.low_processor_usage_mode_sleep_usec],
			" paused" if paused else " running")
