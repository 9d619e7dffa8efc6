import "./style.css";
import { Explorer } from "./explorer";

new Explorer();
