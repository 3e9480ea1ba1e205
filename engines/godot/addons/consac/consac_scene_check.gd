@tool
class_name ConsacSceneCheck
extends RefCounted
## What of a scene would go wrong under a [ConsacSync], told before it does: in one line when it begins, and in the
## editor as warnings of the node.


## Why the world below [param root] cannot be learned from in loop mode, or "": nothing in it moves by itself there.
static func fault_of_loop(root: Node) -> String:
	for node in root.find_children("*", "", true, false):
		var moves := (node is RigidBody2D and not (node as RigidBody2D).freeze
				or node is RigidBody3D and not (node as RigidBody3D).freeze)
		if moves:
			return ("loop_mode stops the engine's physics, and %s is a %s that it moves; turn loop_mode off, or freeze "
					+ "the body") % [node.name, node.get_class()]
	return ""


## The first node below [param root] that goes with frames and not with physics ticks, or null: its time is right only
## where each tick has a frame.
static func frame_bound(root: Node) -> Node:
	for node in root.find_children("*", "", true, false):
		if node is Timer and (node as Timer).process_callback == Timer.TIMER_PROCESS_IDLE:
			return node
		if (node is AnimationMixer and (node as AnimationMixer).callback_mode_process
				== AnimationMixer.ANIMATION_CALLBACK_MODE_PROCESS_IDLE):
			return node
		if node is AnimatedSprite2D or node is AnimatedSprite3D:
			return node
		if node.is_processing() and node.get_script() != null and not _is_ours(node):
			return node
	return null


## What the editor shows beside [param sync].
static func warnings_of(sync: Node) -> PackedStringArray:
	var found := PackedStringArray()
	var root := sync.get_parent()
	if root == null:
		return found
	var scene := sync.owner if sync.owner != null else root
	if nodes_of_class(scene, &"ConsacSync").size() > 1:
		found.append("The scene has several ConsacSync nodes; only one can drive it.")
	var agents := nodes_of_class(root, &"ConsacAgent")
	if agents.is_empty() and not sync.get("mode") in [2, 3]:
		found.append("There is no ConsacAgent below %s: put this node beside or above the agents." % root.name)
	for agent in agents:
		for role: String in ["observations", "actions"]:
			var fault := _fault_of_entries(agent, role)
			if not fault.is_empty():
				found.append("%s: %s" % [agent.name, fault])
		var unpaid := _fault_of_goals(agent)
		if not unpaid.is_empty():
			found.append("%s: %s" % [agent.name, unpaid])
		for sensor in nodes_of_class(agent, &"ConsacSensor"):
			for property: String in ["body", "viewport", "observer", "subject", "origin"]:
				if property in sensor and sensor.get(property) == null:
					found.append("%s/%s: %s is empty; set it to a node." % [agent.name, sensor.name, property])
	var unnamed := _fault_of_parameters(sync)
	if not unnamed.is_empty():
		found.append(unnamed)
	if sync.get("loop_mode") and sync.get("mode") in [0, 1]:  # where something learns
		var fault := fault_of_loop(root)
		if not fault.is_empty():
			found.append(fault)
	return found


# In the editor the scripts of a game do not run: what is set there can be read, what _init() sets cannot.
static func _fault_of_entries(agent: Node, role: String) -> String:
	var entries: Variant = agent.get(role)
	if not entries is Array:
		return ""
	if entries.is_empty():
		if role == "observations" and not nodes_of_class(agent, &"ConsacSensor").is_empty():
			return ""
		var script: Script = agent.get_script()
		while script != null and script.resource_path.get_file() != "consac_agent.gd":
			if script is GDScript and (script as GDScript).source_code.contains(role):
				return ""
			script = script.get_base_script()
		return "it has no %s; add a ConsacEntry for each." % role
	var seen := {}
	for entry: Variant in entries:
		var fault := "an entry of %s is empty." % role if entry == null else ""
		if fault.is_empty() and (entry as Resource).get("name") == &"":
			fault = "an entry of %s has no name." % role
		if fault.is_empty() and seen.has(entry.name):
			fault = "two %s are named '%s'." % [role, entry.name]
		if not fault.is_empty():
			return fault
		seen[entry.name] = true
	return ""


static func _fault_of_parameters(sync: Node) -> String:
	var seen := {}
	var parameters: Variant = sync.get("parameters")
	if not parameters is Array:  # its script cannot be read
		return ""
	for parameter: Variant in parameters:
		var name: Variant = &"" if parameter == null else parameter.get("name")
		if name == &"":
			return "One of parameters is empty or has no name."
		if seen.has(name):
			return "Two parameters are named '%s'." % name
		seen[name] = true
	return ""


# Goals without what they pay, or the other way round, as far as the inspector holds them.
static func _fault_of_goals(agent: Node) -> String:
	var entries: Variant = agent.get("observations")
	if not entries is Array or entries.is_empty():
		return ""
	var names: Array = entries.map(func(entry: Variant) -> StringName: return &"" if entry == null else entry.get("name"))
	var has := names.has(&"achieved_goal") and names.has(&"desired_goal")
	if agent.get("goals") == null:
		return "it observes goals, but nothing says what they pay; set goals to a ConsacGoals." if has else ""
	if has or not nodes_of_class(agent, &"ConsacSensor").is_empty():
		return ""
	return "it has goals, but does not observe achieved_goal and desired_goal; add a box for each."


## Nodes below, whose script is this class or stems from it; works where scripts do not run.
static func nodes_of_class(root: Node, name: StringName) -> Array[Node]:
	var found: Array[Node] = []
	for node in root.find_children("*", "Node", true, false):
		var script: Script = node.get_script()
		while script != null and script.get_global_name() != name:
			script = script.get_base_script()
		if script != null:
			found.append(node)
	return found


static func _is_ours(node: Node) -> bool:
	return node.get_script().resource_path.begins_with("res://addons/consac/")
