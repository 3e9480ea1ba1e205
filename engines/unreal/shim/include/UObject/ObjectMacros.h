#pragma once
/// What may be said of an object that is made.
enum EObjectFlags { RF_NoFlags = 0, RF_Transient = 0x40 };
