class_name ConsacSpeed
extends RefCounted
## The engine's pace. Changes it for a session and puts everything back as it was.

## Physics ticks in one second of the clock, at most, are this many times those of the project. A
## power of two, so that a tick's length is the same number, bit for bit, at either pace.
const TIMES := 1024
const TICKS_A_FRAME := 64  # a window draws about once a second of the world

var _saved := {}


## No limit of frames; [param fast]: physics ticks of the usual length, as fast as they can be
## computed.
func change(fast: bool) -> void:
	if _saved.is_empty():
		_saved = {
			max_fps = Engine.max_fps,
			ticks = Engine.physics_ticks_per_second,
			time_scale = Engine.time_scale,
			most_ticks = Engine.max_physics_steps_per_frame,
			jitter_fix = Engine.physics_jitter_fix,
			low_processor = OS.low_processor_usage_mode,
			sleep_usec = OS.low_processor_usage_mode_sleep_usec,
			vsync = DisplayServer.window_get_vsync_mode(),
		}
	OS.low_processor_usage_mode = false
	Engine.max_fps = 0
	if fast:
		OS.low_processor_usage_mode_sleep_usec = 1  # without a window the engine sleeps so long in every frame
		DisplayServer.window_set_vsync_mode(DisplayServer.VSYNC_DISABLED)
		Engine.physics_ticks_per_second = _saved.ticks * TIMES
		Engine.time_scale = _saved.time_scale * TIMES
		Engine.max_physics_steps_per_frame = TICKS_A_FRAME
		Engine.physics_jitter_fix = 0.0


## As it was before [method change].
func restore() -> void:
	if _saved.is_empty():
		return
	OS.low_processor_usage_mode = _saved.low_processor
	OS.low_processor_usage_mode_sleep_usec = _saved.sleep_usec
	Engine.max_fps = _saved.max_fps
	Engine.physics_ticks_per_second = _saved.ticks
	Engine.time_scale = _saved.time_scale
	Engine.max_physics_steps_per_frame = _saved.most_ticks
	Engine.physics_jitter_fix = _saved.jitter_fix
	if DisplayServer.window_get_vsync_mode() != _saved.vsync:
		DisplayServer.window_set_vsync_mode(_saved.vsync)
	_saved = {}
