@icon("res://addons/consac/icon.svg")
class_name ConsacRaySensor2D
extends ConsacRaySensor
## Rays from a Node2D: straight ahead is its x axis.

## Where the rays begin; not hit itself.
@export var body: Node2D


func _towards(angle: float) -> Variant:
	return Vector2.from_angle(angle)


func _cast(angle: float) -> Dictionary:
	var from := body.global_position
	var query := PhysicsRayQueryParameters2D.create(
			from, from + _towards(body.global_rotation + angle) * length, collision_mask)
	query.collide_with_areas = hit_areas
	if body is CollisionObject2D:
		query.exclude = [(body as CollisionObject2D).get_rid()]
	var hit := body.get_world_2d().direct_space_state.intersect_ray(query)
	if not hit.is_empty():
		hit["distance"] = from.distance_to(hit["position"])
	return hit
