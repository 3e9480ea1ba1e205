class_name ConsacLeaving
extends RefCounted
## Agents that leave the scene; and what becomes of a game whose [ConsacSync] has left it while it drove it: freed, or gone
## with a scene that was changed. It is gone by then, so nothing of it is asked here.


## Whether an agent is out of the scene, or will be at the end of this frame, alone or with what it is in.
static func of(agent: ConsacAgent) -> bool:
	var node: Node = agent
	while node != null and not node.is_queued_for_deletion():
		node = node.get_parent()
	return node != null or not agent.is_inside_tree()


## Says that the sync has, once the tree has its new shape; with [param quits] ends the program, unless another sync goes on.
static func tell(doing: String, steps: int, learning: bool, quits: bool) -> void:
	var tree := Engine.get_main_loop() as SceneTree
	if tree == null or tree.root == null:  # the program ends, and with it everything
		return
	var what := "the ConsacSync has left the scene after %d steps (%s): " % [steps, doing]
	what += "its session is over; keep it in the tree until it has ended" if learning else "its agents are driven no more"
	printerr("consac: ", what)
	ConsacRemote.tell_of_failure(what)
	if not quits:
		return
	for i in 3:  # a scene that follows is there after two frames
		await tree.process_frame
	for sync: ConsacSync in tree.get_nodes_in_group(ConsacSync.GROUP):
		if not sync.is_stopped():
			return
	tree.quit(1 if learning else 0)
