// Drives the README's Walker as the add-on's signals would, and a model.
using System;
using Godot;

public static class Program
{
    private static void Check(string what, bool right)
    {
        Console.WriteLine((right ? "ok " : "FAIL ") + what);
    }

    public static void Main()
    {
        var agent = new Node();
        float earned = 0;
        bool ended = false;
        agent.Properties["rng"] = new RandomNumberGenerator();
        agent.Properties["steps"] = 3;
        agent.Methods["add_reward"] = given => { earned += given[0].AsSingle(); return new Variant(); };
        agent.Methods["end_episode"] = given => { ended = true; return new Variant(); };
        var walker = new Walker { Parent = agent };
        walker._EnterTree();
        walker._EnterTree();  // the agent has moved, and it with it: nothing is connected twice
        ((Action<long>)agent.Signals["resetting"])(7);
        var seen = new Godot.Collections.Dictionary();
        ((Action<Godot.Collections.Dictionary>)agent.Signals["observing"])(seen);
        Check("it observes", seen["place"].AsSingle() == 0);
        var chosen = new Godot.Collections.Dictionary();
        chosen["move"] = 5.0f;
        ((Action<Godot.Collections.Dictionary>)agent.Signals["acting"])(chosen);
        ((Action)agent.Signals["judging"])();
        Check("it acts and earns", Math.Abs(earned - 0.5) < 1e-6 && !ended && walker.Steps == 3);
        chosen["move"] = 50.0f;
        ((Action<Godot.Collections.Dictionary>)agent.Signals["acting"])(chosen);
        ((Action)agent.Signals["judging"])();
        Check("it ends", ended);

        var legal = new Godot.Collections.Dictionary();
        legal["jump"] = new byte[] { 1, 1 };
        ((Action<Godot.Collections.Dictionary>)agent.Signals["masking"])(legal);
        Check("it forbids", legal["jump"].AsByteArray()[1] == 0);

        var native = new GodotObject();
        native.Methods["load"] = given => given[0].AsString() == "res://m.consac" ? "" : "there is no file";
        native.Methods["predict_named"] = given => given[0];
        ClassDB.Next = native;
        var model = new Consac.Model();
        Check("a model is loaded", model.Load("res://m.consac") == "");
        Check("and asked by names", model.PredictNamed(seen) == seen);
    }
}
