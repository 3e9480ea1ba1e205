class_name ConsacSpeed
extends RefCounted
## The engine's pace. Changes it for a session and puts everything back as it was.

## Physics ticks in one second of the clock, at most, are this many times those of the project: so many that after any
## frame as many are due as may precede the next one, and so few that the engine's count of them (an int) holds a frame
## of half an hour. A power of two, so that a tick's length is the same number, bit for bit, at either pace.
const TIMES := 16384
const TICKS_A_FRAME := 64  # unless the world goes with frames; a window draws about once a second of the world
const DRAWN_EVERY_USEC := 50000  # where each tick has a frame, so often one is drawn

## Whether each tick has a frame; then [method note_tick] is called.
var frame_a_tick := false

var _saved := {}
var _drawn_usec := 0


## No limit of frames; [param fast]: physics ticks of the usual length, as fast as they can be
## computed, [param ticks_a_frame] before each frame. With 1, timers and [code]_process[/code] go with the ticks; most
## of those frames are not drawn.
func change(fast: bool, ticks_a_frame := TICKS_A_FRAME) -> void:
	if _saved.is_empty():
		_saved = {
			max_fps = Engine.max_fps,
			ticks = Engine.physics_ticks_per_second,
			time_scale = Engine.time_scale,
			most_ticks = Engine.max_physics_steps_per_frame,
			jitter_fix = Engine.physics_jitter_fix,
			low_processor = OS.low_processor_usage_mode,
			sleep_usec = OS.low_processor_usage_mode_sleep_usec,
			draws = RenderingServer.render_loop_enabled,
			vsync = DisplayServer.window_get_vsync_mode(),
		}
	OS.low_processor_usage_mode = false
	Engine.max_fps = 0
	if fast:
		OS.low_processor_usage_mode_sleep_usec = 1  # without a window the engine sleeps so long in every frame
		DisplayServer.window_set_vsync_mode(DisplayServer.VSYNC_DISABLED)
		Engine.physics_ticks_per_second = _saved.ticks * TIMES
		Engine.time_scale = _saved.time_scale * TIMES
		Engine.max_physics_steps_per_frame = ticks_a_frame
		frame_a_tick = ticks_a_frame == 1
		Engine.physics_jitter_fix = 0.0


## How many ticks before each frame suit the world below [param root] while something learns: what goes with frames wants one
## for each tick, where [param ticks] pass at all.
static func ticks_for(root: Node, ticks: bool) -> int:
	if not ticks:
		return TICKS_A_FRAME
	var node := ConsacSceneCheck.frame_bound(root)
	if node == null and root.get_tree().get_processed_tweens().is_empty():
		return TICKS_A_FRAME
	print("consac: %s goes with frames, so each tick has one while it learns; where it only draws, ticks_a_frame = %d is faster"
			% ["a tween" if node == null else "%s (%s)" % [root.get_path_to(node), node.get_class()], TICKS_A_FRAME])
	return 1


## Once a tick: decides whether its frame is drawn.
func note_tick() -> void:
	var now := Time.get_ticks_usec()
	var draws := now - _drawn_usec >= DRAWN_EVERY_USEC
	RenderingServer.render_loop_enabled = draws and _saved.draws
	if draws:
		_drawn_usec = now


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
	RenderingServer.render_loop_enabled = _saved.draws
	frame_a_tick = false
	if DisplayServer.window_get_vsync_mode() != _saved.vsync:
		DisplayServer.window_set_vsync_mode(_saved.vsync)
	_saved = {}
