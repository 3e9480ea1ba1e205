#pragma once
/// What of a world ticks; all of it here.
enum ELevelTick { ShimAllTicks };
/// Whose world it is.
enum ENetMode { NM_Standalone, NM_DedicatedServer, NM_ListenServer, NM_Client };
