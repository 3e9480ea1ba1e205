extends Node2D
## Two syncs under two parents; the second one is refused. When the first is gone, another one may come.


class Stands:
	extends ConsacAgent

	func _init() -> void:
		observations = [ConsacEntry.box(&"place", 1)]
		actions = [ConsacEntry.box(&"nothing", 1)]

	func observe(into: Dictionary) -> void:
		into[&"place"] = 0.0


func _half(sync_name: String) -> Node:
	var half := Node.new()
	var sync := ConsacSync.new()
	sync.name = sync_name
	half.add_child(Stands.new())
	half.add_child(sync)
	add_child(half)
	return half


func _ready() -> void:
	var first := _half("First")
	_half("Second")
	for tick in 20:
		await get_tree().physics_frame
	var went: bool = first.get_node("First").steps > 5
	first.queue_free()
	await get_tree().physics_frame
	var third := _half("Third")
	for tick in 20:
		await get_tree().physics_frame
	print("two_syncs: first went on: %s, the next one after it: %s" % [went, third.get_node("Third").steps > 5])
	get_tree().quit(1)
