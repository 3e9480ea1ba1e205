class_name ConsacSensorDrawing2D
extends Node2D
## Draws the lines of a sensor around the node that it hangs on.

## Whose.
var sensor: ConsacSensor


func _init() -> void:
	top_level = true  # not scaled with the node
	z_index = 100


func _process(_delta: float) -> void:
	var node: Node2D = get_parent()
	global_transform = Transform2D(node.global_rotation, node.global_position)
	queue_redraw()


func _draw() -> void:
	if not is_instance_valid(sensor):
		return
	var lines := sensor.lines()
	for i in range(0, lines.size() - 2, 3):
		draw_line(lines[i], lines[i + 1], lines[i + 2], 1.5, true)
