#pragma once
namespace EWorldType {
enum Type { None, Game, Editor, PIE };
}

enum ECollisionChannel { ECC_Visibility };
