extends SceneTree
## Many agents of one behaviour in one scene, a few calls of ConsacWorld a step, whatever their
## number. Run by test_native.py and bench/godot_bench.py:
##   godot ... --script crowd.gd -- AGENTS WHO WAY SECONDS [MODEL]
##   WHO: serve prints the port and serves one trainer; train learns inside the engine and stands
##     still meanwhile, go_on does not stand still; both save MODEL; act acts by MODEL
##   WAY: frame is a step for each physics tick, 60 a second; fixed is as fast as ticks can be
##     computed; loop is many steps a tick
## Ends with one line "crowd: N agents, S agent steps/s, ... ms a step, ... ms of it in poll, ...".

const LIMIT := 200  # steps of an episode
const MOVES: Array[Vector2] = [Vector2.ZERO, Vector2.LEFT, Vector2.RIGHT, Vector2.UP, Vector2.DOWN]

var _world := ConsacWorld.new()
var _count := 0
var _way := ""
var _seconds := 0.0
var _places := PackedFloat32Array()  # [agents, 2]
var _rewards := PackedFloat32Array()
var _ends := PackedByteArray()
var _rng := RandomNumberGenerator.new()
var _speed := ConsacSpeed.new()
var _steps := 0  # of all agents together
var _since := 0  # usec; 0: nobody has asked for anything
var _polled := 0  # usec
var _polls := PackedInt64Array()


func _initialize() -> void:
	var arguments := OS.get_cmdline_user_args()
	_count = arguments[0].to_int()
	_way = arguments[2]
	_seconds = arguments[3].to_float()
	_places.resize(2 * _count)
	_rewards.resize(_count)
	_ends.resize(_count)
	_world.create({behaviours = [{
		agents = _count,
		observations = [{name = "place", type = "box", shape = [2]}],
		actions = [{name = "move", type = "discrete", n = MOVES.size()}]}]})
	for i in _count:
		_world.join(0)
	var fault := ""
	match arguments[1]:
		"serve":
			fault = _world.serve({port = 0, training_length = 1000000000})
			print("consac: waiting for a trainer on port %d" % _world.port())
		"train", "go_on":
			fault = _world.train({
				total_steps = 1000000000,
				while_learning = "wait" if arguments[1] == "train" else "go_on",
				hyperparameters = {n_steps = maxi(16, 2048 / _count)}})
		"act":
			fault = _world.act({models = [arguments[4]]})
	_speed.change(_way != "frame")
	if not fault.is_empty():
		quit(1)


func _physics_process(_delta: float) -> bool:
	var until := Time.get_ticks_usec() + 100000
	while true:
		var before := Time.get_ticks_usec()
		var cue := _world.poll(0.1 if _way == "loop" or _since > 0 else 0.001)
		var after := Time.get_ticks_usec()
		match cue:
			ConsacWorld.WAIT:
				return false
			ConsacWorld.RESET:
				for i in _count:
					_begin(i)
			ConsacWorld.ACT:
				if _since == 0:
					_since = after
				_polled += after - before
				_polls.append(after - before)
				_move()
				_steps += 1
			_:
				return _finish()
		_world.set_observations(0, _places)
		_world.offer()
		if _since > 0 and after - _since > _seconds * 1e6:
			return _finish()
		if _way != "loop" or after > until:
			return false
	return false


func _move() -> void:
	var moves := _world.actions(0)
	for i in _count:
		var move := MOVES[int(moves[i])]
		var x := clampf(_places[2 * i] + 0.1 * move.x, -1.0, 1.0)
		var y := clampf(_places[2 * i + 1] + 0.1 * move.y, -1.0, 1.0)
		_places[2 * i] = x
		_places[2 * i + 1] = y
		_rewards[i] = -absf(x) - absf(y)
	_world.add_rewards(0, _rewards)
	if _steps % LIMIT == LIMIT - 1:
		_ends.fill(ConsacWorld.TRUNCATED)
		_world.end_episodes(0, _ends)
		_world.set_final_observations(0, _places)
		for i in _count:
			_begin(i)


func _begin(i: int) -> void:
	_places[2 * i] = _rng.randf_range(-1.0, 1.0)
	_places[2 * i + 1] = _rng.randf_range(-1.0, 1.0)


func _finish() -> bool:
	var passed := maxf(1e-6, (Time.get_ticks_usec() - _since) / 1e6)
	var counted := maxi(1, _steps)
	_polls.sort()
	print("crowd: %d agents, %d agent steps/s, %.4f ms a step, %.4f ms of it in poll, half below %.4f ms" % [
			_count, _steps * _count / passed, 1e3 * passed / counted, _polled / 1e3 / counted,
			_polls[_polls.size() / 2] / 1e3 if not _polls.is_empty() else 0.0])
	var arguments := OS.get_cmdline_user_args()
	if arguments.size() > 4 and arguments[1] in ["train", "go_on"]:
		_world.save_model(0, arguments[4])
	_world.close()
	_speed.restore()
	return true
