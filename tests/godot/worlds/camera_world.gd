extends Node2D
## A wall whose grey is the agent's own number; sees whether each picture shows the number of that moment.

var right := 0
var wrong := 0


class Sees:
	extends ConsacAgent
	var number := 0
	var wall := ColorRect.new()
	var eye := ConsacCameraSensor.new()

	func _init() -> void:
		observations = [ConsacEntry.box(&"number", 1, 0.0, 255.0)]
		actions = [ConsacEntry.box(&"nothing", 1)]
		max_steps = 7

	func reset(_seed: int) -> void:
		act({})

	func act(_chosen: Dictionary) -> void:
		number = rng.randi_range(0, 255)
		wall.color = Color8(number, number, number)

	func observe(into: Dictionary) -> void:
		into[&"number"] = number

	func look() -> String:
		var said := super()
		var picture: Variant = values.get(&"eye")
		if picture is PackedByteArray and picture[0] == number and picture[-1] == number:
			get_parent().right += 1
		else:
			get_parent().wrong += 1
		return said


func _ready() -> void:
	var agent := Sees.new()
	agent.name = "Agent"
	var view := SubViewport.new()
	view.size = Vector2i(8, 6)
	agent.wall.size = Vector2(8, 6)
	view.add_child(agent.wall)
	agent.eye.name = "Eye"
	agent.eye.entry_name = &"eye"
	agent.eye.grey = true
	agent.eye.viewport = view
	agent.add_child(agent.eye)
	var sync := ConsacSync.new()
	sync.session_ended.connect(func(_fault: String) -> void: print("camera: %d right, %d wrong" % [right, wrong]))
	for node: Node in [view, agent, sync]:
		add_child(node)
