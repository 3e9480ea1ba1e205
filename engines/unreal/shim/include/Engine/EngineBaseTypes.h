#pragma once
/// Whose world it is.
enum ENetMode { NM_Standalone, NM_DedicatedServer, NM_ListenServer, NM_Client };
