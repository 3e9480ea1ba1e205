class_name ConsacRaySensor
extends ConsacSensor
## What rays hit, and how far away: for each ray the distance (0 here, 1 at the end or nothing hit),
## then for each of [member classes] 1 where the hit body is in that group, else 0. Use
## [ConsacRaySensor2D] or [ConsacRaySensor3D].

## Length of a ray.
@export_range(0.001, 1e6) var length: float = 10.0
## How many rays.
@export_range(1, 1000) var count: int = 7
## Degrees from the first ray to the last; 360 spreads them evenly all around.
@export_range(0.0, 360.0) var spread_deg: float = 120.0
## Groups that are told apart.
@export var classes: Array[StringName] = []
## Physics layers that rays hit.
@export_flags_3d_physics var collision_mask: int = 0xffffffff
## Rays also hit areas.
@export var hit_areas: bool = false

const HIT := Color(1.0, 0.3, 0.2, 0.9)
const FREE := Color(0.6, 0.9, 1.0, 0.35)

var _seen := PackedFloat32Array()  # the latest distances, 0 to 1


func fault() -> String:
	return "" if get(&"body") != null else "set body to the node that the rays begin at"


func entries() -> Array[ConsacEntry]:
	return [ConsacEntry.box(entry_name, count * (1 + classes.size()), 0.0, 1.0)]


func sense(into: Dictionary) -> void:
	var numbers := PackedFloat32Array()
	_seen.resize(count)
	for i in count:
		var hit := _cast(angle_of(i))
		_seen[i] = clampf(hit.get("distance", length) / length, 0.0, 1.0)
		numbers.append(_seen[i])
		var body := hit.get("collider") as Node
		for group in classes:
			numbers.append(1.0 if body != null and body.is_in_group(group) else 0.0)
	into[entry_name] = numbers


func place() -> Node:
	return get(&"body")


func lines() -> Array:
	var all := []
	for i in _seen.size():
		var ray: Variant = _towards(angle_of(i)) * length * _seen[i]
		all.append_array([ray * 0.0, ray, HIT if _seen[i] < 1.0 else FREE])
	return all


## Of ray [param index], in radians from straight ahead.
func angle_of(index: int) -> float:
	if count == 1:
		return 0.0
	var gaps := count if spread_deg >= 360.0 else count - 1
	return deg_to_rad(spread_deg) * (float(index) / gaps - 0.5)


# Override: the direction of a ray as the body sees it, a Vector2 or Vector3 of length 1.
func _towards(_angle: float) -> Variant:
	return Vector2.ZERO


# Override: the hit of intersect_ray with its "distance", or nothing.
func _cast(_angle: float) -> Dictionary:
	return {}
