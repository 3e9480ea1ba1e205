extends Node2D
## Things that go with frames: counts how often a timer of 0.1 s, _process() and a tween of 0.2 s come around, and how many
## ticks at most precede a frame. The clock has no part in any of it.

var timers := 0
var processes := 0
var tweens := 0
var most := 0


class Stands:
	extends ConsacAgent

	func _init() -> void:
		observations = [ConsacEntry.box(&"place", 1)]
		actions = [ConsacEntry.box(&"nothing", 1)]
		max_steps = 10

	func observe(into: Dictionary) -> void:
		into[&"place"] = 0.0


class Counts:
	extends Node
	var world: Node
	var _ticks := 0  # since the latest frame, while the world moved

	func _physics_process(_delta: float) -> void:
		if not get_tree().paused:
			_ticks += 1

	func _process(_delta: float) -> void:
		if not get_tree().paused:
			world.processes += 1
		world.most = maxi(world.most, _ticks)
		_ticks = 0


func _ready() -> void:
	var counter := Counts.new()
	counter.world = self
	counter.process_mode = Node.PROCESS_MODE_ALWAYS  # a frame of a world that stands still is a frame, too
	var timer := Timer.new()
	timer.wait_time = 0.1
	timer.autostart = true
	timer.timeout.connect(func() -> void: timers += 1)
	var tween := create_tween().set_loops()
	tween.tween_interval(0.2)
	tween.tween_callback(func() -> void: tweens += 1)
	var sync := ConsacSync.new()
	sync.session_began.connect(func() -> void:
		timers = 0
		processes = 0
		tweens = 0
		most = 0)
	sync.session_ended.connect(func(_fault: String) -> void:
		print("frames: timer %d process %d tween %d most %d" % [timers, processes, tweens, most]))
	for node: Node in [counter, timer, Stands.new(), sync]:
		add_child(node)
