MODULE Numbers
  VAR num a:=9E9;
  VAR num b:=9e+09;
  VAR num c:=1.;
  VAR num d:=.5;
  VAR num e:=-1.5E-05;
  VAR num f:=0x1F;
  VAR num g:=0o17;
  VAR num h:=0b1010;
  VAR dnum i:=4503599627370496;
  VAR num j:=- 5;
  VAR num k:=1.e2;
ENDMODULE
