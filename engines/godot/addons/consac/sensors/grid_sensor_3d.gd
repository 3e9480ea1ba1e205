@icon("res://addons/consac/icon.svg")
class_name ConsacGridSensor3D
extends ConsacGridSensor
## A grid around a Node3D, in its plane of x and z: ahead is its -z axis.

## What the grid lies around; not seen itself.
@export var origin: Node3D
## How far the cells reach up and down together.
@export_range(0.001, 1e6) var height: float = 2.0

var _shape := BoxShape3D.new()
var _query := PhysicsShapeQueryParameters3D.new()


func _point(at: Vector2) -> Variant:
	var point := Vector3(at.x, 0.0, -at.y)
	return point if turned else origin.global_transform.basis.orthonormalized().inverse() * point


func _set_up() -> void:
	_shape.size = Vector3(cell_size * 0.98, height, cell_size * 0.98)
	_query.shape = _shape
	_query.collision_mask = collision_mask
	_query.collide_with_areas = hit_areas
	if origin is CollisionObject3D:
		_query.exclude = [(origin as CollisionObject3D).get_rid()]


func _in_cell(at: Vector2) -> Array[Dictionary]:
	var basis := origin.global_transform.basis.orthonormalized() if turned else Basis()
	_query.transform = Transform3D(basis, origin.global_position + basis * Vector3(at.x, 0.0, -at.y))
	return origin.get_world_3d().direct_space_state.intersect_shape(_query, MOST_AT_ONCE)
