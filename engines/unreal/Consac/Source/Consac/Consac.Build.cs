// Copyright CONSAC authors. MIT License.
using System.IO;
using UnrealBuildTool;

public class Consac : ModuleRules
{
	public Consac(ReadOnlyTargetRules Target) : base(Target)
	{
		// The staged sources of core and learn are compiled here (Private/Staged): no header of Unreal may be forced into
		// them, each is a file of its own, and their arithmetic must be the trainer's to the bit.
		PCHUsage = PCHUsageMode.NoPCHs;
		bUseUnity = false;
		FPSemantics = FPSemanticsMode.Precise;
		CppStandard = CppStandardVersion.Cpp20;
		PublicDependencyModuleNames.AddRange(new string[] { "Core", "CoreUObject", "Engine" });
		PrivateDependencyModuleNames.AddRange(new string[] { "ConsacCore", "ConsacLearn", "PhysicsCore", "Projects", "RenderCore", "RHI" });
		if (Target.Platform == UnrealTargetPlatform.Win64)
		{
			// Compilers since Visual Studio 17.10 make a std::mutex that a player's older runtime library cannot lock.
			PrivateDefinitions.Add("_DISABLE_CONSTEXPR_MUTEX_CONSTRUCTOR");
		}
		if (Target.bBuildEditor)
		{
			PrivateDependencyModuleNames.Add("UnrealEd"); // so that the editor does not sleep in the background
			PrivateDependencyModuleNames.Add("AssetTools"); // so that trained models become assets
		}
		// What Start Trainer Program starts, as a file beside the game: a packaged game that is tested may train.
		string Program = Target.Platform == UnrealTargetPlatform.Win64 ? "Win64/consac.exe" : "Linux/consac";
		string Packed = Path.Combine(PluginDirectory, "Programs", Program);
		if (Target.Platform != UnrealTargetPlatform.Mac && Target.Configuration != UnrealTargetConfiguration.Shipping && File.Exists(Packed))
		{
			RuntimeDependencies.Add(Packed, StagedFileType.NonUFS);
		}
	}
}
