class_name ConsacTextBackend
extends ConsacBackend
## The engine's end of text protocol 1 (spec/text1.md) in nothing but GDScript: listens, serves one
## trainer and one agent, and after a session waits for the next trainer.

## What a trainer that comes second is told.
const BUSY := "busy: another trainer is connected to this engine; try again when it has left\n"
const LARGEST_FLOAT32 := 3.4028235e38
const SPIN_USEC := 300  # of looking without sleeping, while an answer is likely near
const SHORT_SLEEP_USEC := 30
const LONG_SLEEP_USEC := 300  # once a trainer has not answered for LONG_AFTER_USEC: it learns
const LONG_AFTER_USEC := 3000
const DOOR_USEC := 100000  # between looks for a second trainer
const PREFIX := "PackedFloat32Array("

## The port that is listened on; with 0 a free one is taken, and stands here after [method begin].
var port: int = 5005
## Who may connect: this machine only, unless set to "*" or to an address of it.
var bind_address := "127.0.0.1"
## Sent in the setup: actions to train for; 0 with a model name: only act.
var training_length: int = 0
## Sent in the setup; "" leaves it out.
var model_name := ""
## Seconds of a trainer's silence after which it has left.
var deadline_s := 60.0
## Session k starts from seed + k.
var first_seed: int = 0

## Numbers of the world, of which the protocol carries none.
var parameters: Array[ConsacParameter] = []

var _agent: ConsacAgent
var _choices := 0  # of a discrete action; 0 for a box
var _lows := PackedFloat32Array()
var _highs := PackedFloat32Array()
var _setup := ""
var _server := TCPServer.new()
var _trainer: StreamPeerTCP
var _framer := ConsacTextFramer.new()
var _out := PackedByteArray()
var _refusal := ""
var _sessions := 0
var _steps := 0
var _fresh := true  # the next observation begins a session
var _heard_usec := 0
var _door_usec := 0
var _told := false  # of what the protocol does not carry


func begin(agents: Array[ConsacAgent]) -> String:
	if agents.size() != 1:
		return ("text protocol 1 serves one agent, this scene has %d; several need the native extension "
				+ "(engines/godot/README.md)") % agents.size()
	_agent = agents[0]
	var fault := _describe()
	if not fault.is_empty():
		return fault
	if _server.listen(port, bind_address) != OK:
		return "port %d of %s is taken or not allowed; set another one, or 0 for a free one" % [port, bind_address]
	if _agent.masks_actions:
		push_warning("%s masks its actions, which text protocol 1 cannot carry: mask() counts for nothing, and trainers choose "
				% _agent.path_in_world() + "what is not legal. For protocol 2 " + _how_to_get_protocol2())
	if not parameters.is_empty() or _agent.group != &"":
		_tell_what_is_missing()
	port = _server.get_local_port()
	state = "waiting for a trainer on port %d" % port
	return ""


func offer() -> void:
	if _trainer == null:
		return
	var text := ""
	if _fresh:
		text = _observation(_agent.row, 0.0, 0)
		_fresh = false
	else:
		_steps += 1
		if _agent.terminated or _agent.truncated:
			text = _observation(_agent.final_row, _agent.reward, 1) + _observation(_agent.row, 0.0, 0)
		else:
			text = _observation(_agent.row, _agent.reward, 0)
	# Of all that is written here only "inf" and "nan" have letters but for an exponent's.
	if text.contains("n"):
		var fault := _agent.blame_for(_agent.row)
		refuse(_agent.blame_for(_agent.final_row) if fault.is_empty() else fault)
		return
	_heard_usec = Time.get_ticks_usec()  # from now on the trainer's silence is its own
	_send(text)


func poll(wait_s: float) -> Cue:
	if _trainer == null:
		return _welcome()
	var start := Time.get_ticks_usec()
	var until := start + int(wait_s * 1e6)
	while true:
		var cue := _serve()
		if cue != Cue.WAIT:
			return cue
		var now := Time.get_ticks_usec()
		if now >= until:
			return Cue.WAIT
		if now - start > LONG_AFTER_USEC:
			OS.delay_usec(LONG_SLEEP_USEC)
		elif now - start > SPIN_USEC:
			OS.delay_usec(SHORT_SLEEP_USEC)
	return Cue.WAIT


func tell(_metric: StringName, _value: float) -> void:
	_tell_what_is_missing()


# Once, when the first of it is wanted.
func _tell_what_is_missing() -> void:
	if _told:
		return
	_told = true
	push_warning("text protocol 1 carries no parameters, notes or groups: parameters stay as they are by default, and the trainer "
			+ "hears of nothing. For protocol 2 " + _how_to_get_protocol2())


func refuse(why: String) -> void:
	if _trainer != null:
		_refusal = why


func close() -> void:
	_hang_up()
	_server.stop()
	state = "closed"


static func _how_to_get_protocol2() -> String:
	return ("leave protocol as it is (auto)" if ConsacSync.has_native()
			else "build the native extension, as engines/godot/README.md says")


## Fills the setup message from the agent's entries, or says what the protocol cannot carry.
func _describe() -> String:
	for entry in _agent.all_observations:
		if entry.kind == ConsacEntry.Kind.IMAGE:
			return "entry '%s' is an image: protocol 2 carries it, and needs the native extension" % entry.name
	var action := _space_text(_agent.actions)
	var observation := _space_text(_agent.all_observations)
	if action.is_empty() or observation.is_empty():
		return ("%s: text protocol 1 carries numbers, or one discrete entry alone, and %d numbers at most; a mixture "
				+ "needs the native extension") % [_agent.path_in_world(), ConsacEntry.MOST]
	if training_length < 0 or (training_length == 0 and model_name.is_empty()):
		return "training length %d without a model name; set training_length to the actions to train for" % training_length
	if model_name.contains("#") or model_name != model_name.strip_escapes():
		return "model name '%s' must not hold '#' or control characters" % model_name.c_escape()
	_choices = _agent.actions[0].choices if _agent.actions[0].kind == ConsacEntry.Kind.DISCRETE else 0
	_framer.single_character = _choices > 0 and _choices <= 10
	_setup = "%s#%s#%d" % [action, observation, training_length]
	if not model_name.is_empty():
		_setup += "#" + model_name
	_lows = _sides(_agent.actions, false)
	_highs = _sides(_agent.actions, true)
	return ""


func _space_text(entries: Array[ConsacEntry]) -> String:
	if entries.size() == 1 and entries[0].kind == ConsacEntry.Kind.DISCRETE:
		return "D#%d#0" % entries[0].choices
	var low := _sides(entries, false)
	if low.is_empty() or low.size() > ConsacEntry.MOST:
		return ""
	return "B#%d#%s,%s" % [low.size(), _numbers(low), _numbers(_sides(entries, true))]


## All lows or all highs; empty where an entry is no box.
func _sides(entries: Array[ConsacEntry], upper: bool) -> PackedFloat32Array:
	var sides := PackedFloat32Array()
	for entry in entries:
		if entry.kind != ConsacEntry.Kind.BOX:
			return PackedFloat32Array()
		for i in entry.size:
			sides.append(clampf(entry.high if upper else entry.low, -LARGEST_FLOAT32, LARGEST_FLOAT32))
	return sides


# The engine's own writer of numbers gives the shortest text that reads back exactly, whatever the
# locale.
func _numbers(row: PackedFloat32Array) -> String:
	return var_to_str(row).trim_prefix(PREFIX).trim_suffix(")").replace(" ", "")


func _observation(row: PackedFloat32Array, reward: float, done: int) -> String:
	return "%s#%s#%d\n" % [_numbers(row), var_to_str(reward), done]


func _welcome() -> Cue:
	if not _server.is_connection_available():
		return Cue.WAIT
	_trainer = _server.take_connection()
	_trainer.set_no_delay(true)
	_framer.clear()
	_out.clear()
	_refusal = ""
	error = ""
	note = ""
	_steps = 0
	_fresh = true
	_sessions += 1
	session_seed = first_seed + _sessions
	_heard_usec = Time.get_ticks_usec()
	state = "a trainer is connected"
	_send(_setup + "\n")
	return Cue.RESET


## One look at the connection.
func _serve() -> Cue:
	if not _refusal.is_empty():
		_send("error: " + _refusal + "\n")
		return _fail(_refusal)
	_trainer.poll()  # before the status is read
	var now := Time.get_ticks_usec()
	if now - _door_usec > DOOR_USEC:
		_door_usec = now
		_turn_away()
	var connected := _trainer.get_status() == StreamPeerTCP.STATUS_CONNECTED
	var there := _trainer.get_available_bytes() if connected else 0
	if there > 0:
		var got: Array = _trainer.get_partial_data(there)
		if got[0] == OK:
			_heard_usec = now
			if not _framer.feed(got[1], now):
				return _refuse_now("a message is longer than %d bytes; text protocol 1 sends one line" % ConsacTextFramer.LONGEST)
	if connected and not _out.is_empty():
		_flush()
	var message := _framer.next(now)
	if not message.is_empty():
		return _take(message)
	if not connected:
		return _left()
	if now - _heard_usec > deadline_s * 1e6:
		return _fail("the trainer is silent for %s s; its session is over" % deadline_s)
	return Cue.WAIT


## Reads an action into the agent.
func _take(message: PackedByteArray) -> Cue:
	var text := message.get_string_from_ascii() if _printable(message) else ""
	var fault := ""
	if text.is_empty():
		fault = "no text; protocol 2 needs the native extension, and text protocol 1 --protocol text1 (in Python protocol=\"text1\")"
	elif _choices > 0:
		fault = _take_choice(text)
	else:
		fault = _take_box(text)
	if fault.is_empty():
		return Cue.ACT
	return _refuse_now("action %s: %s" % [_quote(message), fault])


func _take_choice(text: String) -> String:
	var choice := text.to_int() if text.is_valid_int() else -1
	if choice < 0 or choice >= _choices:
		return "it is no choice from 0 to %d" % (_choices - 1)
	_agent.action_row[0] = choice
	return ""


func _take_box(text: String) -> String:
	var numbers := text.split(",")
	if numbers.size() != _lows.size():
		return "it holds %d numbers, expected %d" % [numbers.size(), _lows.size()]
	for i in numbers.size():
		var value := numbers[i].to_float() if numbers[i].is_valid_float() else NAN
		if not is_finite(value):
			return "number %d is '%s', expected a finite number" % [i + 1, numbers[i]]
		_agent.action_row[i] = clampf(value, _lows[i], _highs[i])
	return ""


func _left() -> Cue:
	completed = _steps >= training_length
	note = "" if completed else "the trainer left after %d of %d steps" % [_steps, training_length]
	_hang_up()
	return Cue.DONE


func _refuse_now(why: String) -> Cue:
	_send("error: " + why + "\n")
	return _fail(why)


func _fail(why: String) -> Cue:
	error = why
	_hang_up()
	return Cue.FAILED


func _hang_up() -> void:
	if _trainer != null:
		_trainer.disconnect_from_host()
	_trainer = null
	state = "waiting for a trainer on port %d" % port


func _turn_away() -> void:
	while _server.is_connection_available():
		var second := _server.take_connection()
		second.put_data(BUSY.to_ascii_buffer())
		second.disconnect_from_host()


func _send(text: String) -> void:
	_out.append_array(text.to_utf8_buffer())
	_flush()


# What the trainer does not take at once waits for the next look, so that a slow one never stops the
# engine.
func _flush() -> void:
	var sent: Array = _trainer.put_partial_data(_out)
	_out = _out.slice(sent[1]) if sent[0] == OK and sent[1] < _out.size() else PackedByteArray()


static func _printable(message: PackedByteArray) -> bool:
	for byte in message:
		if byte < 0x20 or byte > 0x7e:
			return false
	return true


static func _quote(message: PackedByteArray) -> String:
	var text := ""
	for byte in message.slice(0, 60):
		text += char(byte) if byte >= 0x20 and byte <= 0x7e else "\\x%02x" % byte
	return "'%s'%s" % [text, "..." if message.size() > 60 else ""]
