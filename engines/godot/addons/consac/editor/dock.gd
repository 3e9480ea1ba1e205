@tool
extends VBoxContainer
## The dock CONSAC: starts the edited scene so that it trains, shows how it goes, stops it. What is set here goes before
## what the scene's ConsacSync says, for this run alone.

const MODES: Array[Array] = [
	["train", "Train in the game"], ["serve", "Wait for consac train"], ["act", "Act by the model"], ["by_hand", "By hand"]]
const PATIENCE_MSEC := 15000  # for the editor to run a scene that it was asked to
const LiveCurve := preload("res://addons/consac/editor/curve.gd")
const Debugger := preload("res://addons/consac/editor/debugger.gd")

## Arguments of the run that begins; none where it is not this dock's.
var arguments := PackedStringArray()

var _debugger: Debugger
var _mode := OptionButton.new()
var _steps := SpinBox.new()
var _model := LineEdit.new()
var _start := Button.new()
var _stop := Button.new()
var _state := Label.new()
var _shown := OptionButton.new()
var _curve := LiveCurve.new()
var _curves := {}  # name: points
var _ended := ""
var _began := false  # the game's ConsacSync has said so
var _asked_msec := 0


## Made with the plugin's debugger.
func set_up(debugger: Debugger) -> void:
	name = "CONSAC"
	_debugger = debugger
	debugger.heard.connect(_hear)
	for mode in MODES:
		_mode.add_item(mode[1])
	_mode.tooltip_text = "Who chooses what the agents do in this run."
	_steps.max_value = 1e12
	_steps.value = 100000
	_steps.step = 1000
	_steps.suffix = "steps"
	_steps.tooltip_text = "Actions to train for."
	_model.text = "res://model.consac"
	_model.tooltip_text = "Where the model is saved, or lies that acts. {behaviour} stands for the name of each."
	_start.text = "Start"
	_start.pressed.connect(_on_start)
	_stop.text = "Stop"
	_stop.disabled = true
	_stop.tooltip_text = "Ends the run; what was learned is saved as NAME.stopped.consac."
	_stop.pressed.connect(_on_stop)
	for button: Button in [_start, _stop]:
		button.size_flags_horizontal = Control.SIZE_EXPAND_FILL
	_state.autowrap_mode = TextServer.AUTOWRAP_WORD_SMART
	_state.text = "Opens the scene that is edited. It needs a ConsacSync."
	_shown.item_selected.connect(func(_index: int) -> void: _show_curve())
	_shown.tooltip_text = "What the curve shows."
	var buttons := HBoxContainer.new()
	buttons.add_child(_start)
	buttons.add_child(_stop)
	for control: Control in [_mode, _steps, _model, buttons, _state, _shown, _curve]:
		add_child(control)


func _on_start() -> void:
	var root := EditorInterface.get_edited_scene_root()
	if root == null or ConsacSceneCheck.nodes_of_class(root, &"ConsacSync").is_empty():
		_state.text = "The edited scene has no ConsacSync; add one beside or above its agents."
		return
	EditorInterface.save_scene()
	arguments = ["--consac-mode=" + MODES[_mode.selected][0], "--consac-steps=%d" % _steps.value, "--consac-report=0.5",
			"--consac-model=" + _model.text]
	if MODES[_mode.selected][0] == "train":
		arguments.append("--consac-sessions=1")
		arguments.append("--consac-quit=1")
	_curves.clear()
	_shown.clear()
	_curve.clear()
	_curve.told_at = 0.0
	_ended = ""
	_began = false
	_asked_msec = Time.get_ticks_msec()
	_state.text = "Starting"
	EditorInterface.play_current_scene()
	_stop.disabled = false


func _on_stop() -> void:
	_debugger.stop_games()


## The plugin asks when a scene is about to run: the arguments of this dock's run, once.
func take_arguments() -> PackedStringArray:
	var taken := arguments
	arguments = PackedStringArray()
	return taken


func _hear(message: String, data: Array) -> void:
	match message:
		"began":
			_stop.disabled = false
			_began = true
			_state.text = data[0]
		"progress":
			var numbers: Dictionary = data[0]
			_state.text = ConsacReport.line_of(numbers, data[1])
			for key: String in numbers:
				if key in ["steps", "seconds"]:
					continue
				if not _curves.has(key):
					_curves[key] = []
					_shown.add_item(key.replace("_", " "))
					_shown.set_item_metadata(-1, key)
					if key == "mean_episode_reward":
						_shown.select(_shown.item_count - 1)
				_curves[key].append(Vector2(numbers.steps, numbers[key]))
			_curve.told_at = numbers.steps
			_show_curve()
		"failed":
			_ended = data[0]
			_state.text = data[0]
		"ended":
			_ended = "It ended." if data[0] == "" else data[0]
			_state.text = _ended + " " + _state.text


func _show_curve() -> void:
	_curve.clear()
	if _shown.selected < 0:
		return
	var key: String = _shown.get_item_metadata(_shown.selected)
	_curve.title = key.replace("_", " ")
	for point: Vector2 in _curves.get(key, []):
		_curve.add(point.x, point.y)


func _process(_delta: float) -> void:
	if _stop.disabled or EditorInterface.is_playing_scene():
		return
	var unheard := not arguments.is_empty()
	if not unheard or Time.get_ticks_msec() - _asked_msec > PATIENCE_MSEC:
		_stop.disabled = true
		arguments = PackedStringArray()
		if unheard:
			_state.text = "The editor did not run the scene; Output says why, and Play Current Scene (F6) shows whether it can."
		elif _ended.is_empty() and not _began:
			_state.text = "The game ended before its ConsacSync began; the panels Output and Debugger say why."
		elif _ended.is_empty():
			_state.text = "Stopped. " + _state.text
		EditorInterface.get_resource_filesystem().scan()  # the model that it saved appears
