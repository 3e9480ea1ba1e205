#pragma once
namespace EWorldType {
enum Type { None, Game, Editor, PIE };
}

namespace EComponentMobility {
enum Type { Static, Stationary, Movable };
}

enum ECollisionChannel { ECC_Pawn = 2, ECC_Visibility };
