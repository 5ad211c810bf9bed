// Checks GLB files with the validator of the Khronos Group: node tests/viewers/gltf.mjs FILE...
// The status is 0 if it finds nothing at all: no error, warning, information or hint.

import { readFileSync } from "node:fs";
import validator from "gltf-validator";

for (const file of process.argv.slice(2)) {
  const { issues, info } = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 20 });
  const { numErrors, numWarnings, numInfos, numHints, messages } = issues;
  const found = `${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints`;
  console.log(`${file}: ${found}; ${info.drawCallCount} parts, ${info.totalTriangleCount} triangles`);
  messages.forEach((message) => console.log(`  ${message.code} ${message.pointer ?? ""}: ${message.message}`));
  if (messages.length > 0) process.exitCode = 1;
}
