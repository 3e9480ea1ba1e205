class_name ConsacBudget
extends CanvasLayer
## A few lines on the screen: what the session does, how fast, and how well.

const EVERY_S := 0.5

var _label := Label.new()
var _steps := 0
var _usec := 0


func _ready() -> void:
	layer = 100
	process_mode = Node.PROCESS_MODE_ALWAYS
	_label.position = Vector2(8, 6)
	_label.add_theme_font_size_override(&"font_size", 13)
	_label.add_theme_color_override(&"font_outline_color", Color.BLACK)
	_label.add_theme_constant_override(&"outline_size", 4)
	add_child(_label)


## Tells it where [param sync] stands; writes twice a second.
func show_state(sync: ConsacSync) -> void:
	var now := Time.get_ticks_usec()
	var passed := (now - _usec) / 1e6
	if passed < EVERY_S:
		return
	var pace := maxi(0, sync.steps - _steps) / passed
	var lines := PackedStringArray([sync.state(), "%.0f steps/s, %d steps" % [pace, sync.steps]])
	if sync.report.episodes > 0:
		lines.append("mean reward of %d episodes: %.2f" % [
				sync.report.episode_rewards.size(), sync.mean_episode_reward()])
	_label.text = "\n".join(lines)
	_steps = sync.steps
	_usec = now
