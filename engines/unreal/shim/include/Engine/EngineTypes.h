#pragma once
namespace EWorldType {
enum Type { None, Game, Editor, PIE };
}

enum ECollisionChannel { ECC_Pawn = 2, ECC_Visibility };
