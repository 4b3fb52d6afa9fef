// Validates GLB files with the Khronos validator: node validate.mjs VALIDATOR_FOLDER FILE…
//
// Prints one line of JSON per file and, last, `N passed, N failed`. Errors and warnings fail, hints do not.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { basename, resolve } from "node:path";
import { argv, exit } from "node:process";

const [folder, ...files] = argv.slice(2);
const validator = createRequire(import.meta.url)(resolve(folder));

/** Whether a file is valid; what was found is printed. */
async function validates(file) {
    const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 0 });
    const { numErrors: errors, numWarnings: warnings, messages } = issues;
    const found = messages.map(({ code, message, pointer }) => ({ code, message, pointer }));
    console.log(JSON.stringify({ file: basename(file), errors, warnings, messages: found }));
    return errors + warnings === 0;
}

let failed = 0;
for (const file of files) {
    failed += (await validates(file)) ? 0 : 1;
}
console.log(`${files.length - failed} passed, ${failed} failed`);
exit(failed ? 1 : 0);
