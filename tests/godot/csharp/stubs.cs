// Stand-ins for what addons/consac/csharp/Consac.cs uses of Godot's C# API, just enough to run it: objects whose methods,
// properties and signals are looked up by name.
using System;
using System.Collections.Generic;

namespace Godot
{
    public enum Error { Ok }
    public struct Vector2 { }
    public struct Vector3 { }
    public struct Transform2D { }
    public struct Transform3D { }

    public struct StringName
    {
        public string Text;
        public static implicit operator StringName(string text) => new StringName { Text = text };
    }

    public struct Variant
    {
        public object Value;
        private static Variant Of(object value) => new Variant { Value = value };
        public static implicit operator Variant(bool value) => Of(value);
        public static implicit operator Variant(int value) => Of((long)value);
        public static implicit operator Variant(long value) => Of(value);
        public static implicit operator Variant(float value) => Of((double)value);
        public static implicit operator Variant(double value) => Of(value);
        public static implicit operator Variant(string value) => Of(value);
        public static implicit operator Variant(float[] value) => Of(value);
        public static implicit operator Variant(byte[] value) => Of(value);
        public static implicit operator Variant(Vector2 value) => Of(value);
        public static implicit operator Variant(Vector3 value) => Of(value);
        public static implicit operator Variant(Transform2D value) => Of(value);
        public static implicit operator Variant(Transform3D value) => Of(value);
        public static implicit operator Variant(GodotObject value) => Of(value);
        public static implicit operator Variant(Collections.Dictionary value) => Of(value);
        public int AsInt32() => Convert.ToInt32(Value);
        public float AsSingle() => Convert.ToSingle(Value);
        public string AsString() => (string)Value;
        public byte[] AsByteArray() => (byte[])((byte[])Value).Clone();
        public GodotObject AsGodotObject() => (GodotObject)Value;
        public Collections.Dictionary AsGodotDictionary() => (Collections.Dictionary)Value;
    }

    public struct Callable
    {
        public Delegate Target;
        public static Callable From(Action action) => new Callable { Target = action };
        public static Callable From<T>(Action<T> action) => new Callable { Target = action };
    }

    public class GodotObject
    {
        public readonly Dictionary<string, Func<Variant[], Variant>> Methods = new Dictionary<string, Func<Variant[], Variant>>();
        public readonly Dictionary<string, Variant> Properties = new Dictionary<string, Variant>();
        public readonly Dictionary<string, Delegate> Signals = new Dictionary<string, Delegate>();
        public Variant Call(StringName method, params Variant[] arguments) => Methods[method.Text](arguments);
        public Variant Get(StringName property) => Properties[property.Text];
        public Error Connect(StringName signal, Callable callable, uint flags = 0)
        {
            Signals.Add(signal.Text, callable.Target);
            return Error.Ok;
        }
    }

    public class Node : GodotObject
    {
        public Node Parent;
        public Node GetParent() => Parent;
        public virtual void _EnterTree() { }
    }
    public class RigidBody2D : Node { }
    public class RigidBody3D : Node { }
    public class GDScript : GodotObject { }
    public class RandomNumberGenerator : GodotObject
    {
        public float RandfRange(float from, float to) => (from + to) / 2;
    }
    public static class GD
    {
        public static T Load<T>(string path) where T : class => Activator.CreateInstance<T>();
    }
    public static class ClassDB
    {
        public static GodotObject Next;
        public static Variant Instantiate(StringName name) => Next;
    }
}

namespace Godot.Collections
{
    public class Dictionary
    {
        private readonly Dictionary<string, Variant> _all = new Dictionary<string, Variant>();
        public Variant this[string key] { get { return _all[key]; } set { _all[key] = value; } }
    }
}
