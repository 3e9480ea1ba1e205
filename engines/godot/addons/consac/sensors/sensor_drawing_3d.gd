class_name ConsacSensorDrawing3D
extends MeshInstance3D
## Draws the lines of a sensor around the node that it hangs on.

## Whose.
var sensor: ConsacSensor


func _init() -> void:
	top_level = true  # not scaled with the node
	mesh = ImmediateMesh.new()
	cast_shadow = GeometryInstance3D.SHADOW_CASTING_SETTING_OFF
	var material := StandardMaterial3D.new()
	material.shading_mode = BaseMaterial3D.SHADING_MODE_UNSHADED
	material.vertex_color_use_as_albedo = true
	material.no_depth_test = true
	material_override = material


func _process(_delta: float) -> void:
	var node: Node3D = get_parent()
	global_transform = Transform3D(node.global_transform.basis.orthonormalized(), node.global_position)
	var drawing: ImmediateMesh = mesh
	drawing.clear_surfaces()
	var lines := sensor.lines() if is_instance_valid(sensor) else []
	if lines.is_empty():
		return
	drawing.surface_begin(Mesh.PRIMITIVE_LINES)
	for i in range(0, lines.size() - 2, 3):
		drawing.surface_set_color(lines[i + 2])
		drawing.surface_add_vertex(lines[i])
		drawing.surface_set_color(lines[i + 2])
		drawing.surface_add_vertex(lines[i + 1])
	drawing.surface_end()
