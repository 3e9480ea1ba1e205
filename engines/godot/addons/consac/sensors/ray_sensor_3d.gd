@icon("res://addons/consac/icon.svg")
class_name ConsacRaySensor3D
extends ConsacRaySensor
## Rays from a Node3D, in its plane of x and z: straight ahead is its -z axis.

## Where the rays begin; not hit itself.
@export var body: Node3D


func _towards(angle: float) -> Variant:
	return Vector3(sin(angle), 0.0, -cos(angle))


func _cast(angle: float) -> Dictionary:
	var from := body.global_position
	var frame := body.global_transform.basis.orthonormalized()
	var query := PhysicsRayQueryParameters3D.create(
			from, from + frame * _towards(angle) * length, collision_mask)
	query.collide_with_areas = hit_areas
	if body is CollisionObject3D:
		query.exclude = [(body as CollisionObject3D).get_rid()]
	var hit := body.get_world_3d().direct_space_state.intersect_ray(query)
	if not hit.is_empty():
		hit["distance"] = from.distance_to(hit["position"])
	return hit
