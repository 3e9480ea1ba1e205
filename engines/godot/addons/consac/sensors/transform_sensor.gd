@icon("res://addons/consac/icon.svg")
class_name ConsacTransformSensor
extends ConsacSensor
## Where a node is, how fast and how turned, as another node sees it. Works in two and in three
## dimensions. Each number lies in -1 to 1: a far node stands at the edge, in its direction.

## Who sees; a Node2D or Node3D.
@export var observer: Node
## What is seen; of the same kind.
@export var subject: Node
## In the observer's turned frame; false: in the world's axes, from the observer's place. A ball
## that rolls wants false.
@export var turned: bool = true
## Distance that is 1.
@export_range(0.001, 1e6) var farthest: float = 10.0
## Speed that is 1.
@export_range(0.001, 1e6) var fastest: float = 10.0
## Observe where it is.
@export var with_position: bool = true
## Observe how fast it is, relative to the observer; bodies know their velocity, other nodes stand
## still.
@export var with_velocity: bool = true
## Observe how it is turned: sine and cosine of the angle, or two axes of its basis.
@export var with_rotation: bool = false


func fault() -> String:
	if observer is Node3D and subject is Node3D or observer is Node2D and subject is Node2D:
		return ""
	return "set observer and subject to two nodes, both Node2D or both Node3D"


func entries() -> Array[ConsacEntry]:
	var dimensions := 3 if observer is Node3D else 2
	var count := dimensions * (int(with_position) + int(with_velocity))
	if with_rotation:
		count += 6 if observer is Node3D else 2
	return [ConsacEntry.box(entry_name, count)]


func sense(into: Dictionary) -> void:
	var numbers := PackedFloat32Array()
	if observer is Node3D and subject is Node3D:
		_sense_3d(observer, subject, numbers)
	elif observer is Node2D and subject is Node2D:
		_sense_2d(observer, subject, numbers)
	into[entry_name] = numbers


func _sense_3d(from: Node3D, to: Node3D, numbers: PackedFloat32Array) -> void:
	var frame := from.global_transform.basis.orthonormalized().transposed() if turned else Basis()
	if with_position:
		_append_3d(numbers, frame * (to.global_position - from.global_position) / farthest)
	if with_velocity:
		_append_3d(numbers, frame * (_velocity_3d(to) - _velocity_3d(from)) / fastest)
	if with_rotation:
		var basis := frame * to.global_transform.basis.orthonormalized()
		_append_3d(numbers, basis.x)
		_append_3d(numbers, basis.y)


func _sense_2d(from: Node2D, to: Node2D, numbers: PackedFloat32Array) -> void:
	var angle := from.global_rotation if turned else 0.0
	if with_position:
		_append_2d(numbers, (to.global_position - from.global_position).rotated(-angle) / farthest)
	if with_velocity:
		_append_2d(numbers, (_velocity_2d(to) - _velocity_2d(from)).rotated(-angle) / fastest)
	if with_rotation:
		_append_2d(numbers, Vector2.from_angle(to.global_rotation - angle))


static func _append_3d(numbers: PackedFloat32Array, vector: Vector3) -> void:
	var near := vector.limit_length(1.0)
	numbers.append(near.x)
	numbers.append(near.y)
	numbers.append(near.z)


static func _append_2d(numbers: PackedFloat32Array, vector: Vector2) -> void:
	var near := vector.limit_length(1.0)
	numbers.append(near.x)
	numbers.append(near.y)


static func _velocity_3d(node: Node3D) -> Vector3:
	if node is RigidBody3D:
		return (node as RigidBody3D).linear_velocity
	return (node as CharacterBody3D).velocity if node is CharacterBody3D else Vector3.ZERO


static func _velocity_2d(node: Node2D) -> Vector2:
	if node is RigidBody2D:
		return (node as RigidBody2D).linear_velocity
	return (node as CharacterBody2D).velocity if node is CharacterBody2D else Vector2.ZERO
